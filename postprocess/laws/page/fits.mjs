/**
 * ISO 286 fits of clearance: limits of hole and shaft by nominal diameter [mm], grade and letter.
 *
 * ISO 286-1:2010, tables 1 to 3, in micrometres, up to 500 mm. Standard tolerances follow i = 0.45 D^(1/3) + 0.001 D (IT5 to
 * IT12 are 7, 10, 16, 25, 40, 64, 100, 160 i) and deviations c to g follow 52 D^0.2 or 95 + 0.8 D, 16 D^0.44, 11 D^0.41,
 * 5.5 D^0.41 and 2.5 D^0.34, with D the geometric mean of the step's ends; the standard rounds them to these tables.
 */

const STEPS = [3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500]; // up to and with
const GRADES = {
    4: [3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20],
    5: [4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27],
    6: [6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40],
    7: [10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63],
    8: [14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97],
    9: [25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155],
    10: [40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250],
    11: [60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400],
    12: [100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630],
};
// How far the nearer limit of a shaft is below the nominal size, and of a hole above it.
const DEVIATIONS = {
    d: [20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230],
    e: [14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135],
    f: [6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68],
    g: [2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20],
    h: new Array(13).fill(0),
};
const FINER = [3, 6, 10, 18, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500];
const C = [60, 70, 80, 95, 110, 120, 130, 140, 150, 170, 180, 200, 210, 230, 240, 260, 280, 300, 330, 360, 400, 440, 480];

const within = (steps, values, diameter) => values[steps.findIndex((end) => diameter <= end)];

/** The limits [lower, upper] of a size such as "H7" or "f7", in micrometres from the nominal diameter. */
export function limitsOf(size, diameter) {
    const [, name, grade] = /^(JS|js|[C-Hc-h])(\d+)$/.exec(size.trim()) ?? [];
    if (!name || !GRADES[grade]) {
        throw new RangeError(`${size} is not a size of ISO 286 that is known here: letters C to H and JS, grades 4 to 12.`);
    }
    if (!(diameter > 0 && diameter <= 500)) {
        throw new RangeError(`a diameter of ${diameter} mm is outside 0 to 500 mm, where ISO 286 has these fits.`);
    }
    const width = within(STEPS, GRADES[grade], diameter);
    const letter = name.toLowerCase();
    if (letter === "js") return [-width / 2, width / 2];
    const nearer = letter === "c" ? within(FINER, C, diameter) : within(STEPS, DEVIATIONS[letter], diameter);
    const isHole = name !== letter;
    return isHole ? [nearer, nearer + width] : [-nearer - width, -nearer];
}

/** The limits of hole and shaft, and the least, mean and largest clearance of diameters, of a fit such as "H7/f7". */
export function fitOf(fit, diameter) {
    const [first, second] = fit.split("/");
    if (!second || first[0] !== first[0].toUpperCase() || second[0] !== second[0].toLowerCase()) {
        throw new RangeError(`${fit} is no fit: the hole comes first, with a capital letter, as in H7/f7.`);
    }
    const hole = limitsOf(first, diameter);
    const shaft = limitsOf(second, diameter);
    const least = hole[0] - shaft[1];
    const largest = hole[1] - shaft[0];
    return { hole, shaft, least, mean: (least + largest) / 2, largest };
}
