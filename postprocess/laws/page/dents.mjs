/** The tables of the force element of the exports: a port of archord's exports/dents.py, which has the equations. */

import { firstTouch, geomspace } from "./law.mjs";

const SAMPLES = 4000; // of phi, up to its largest argument
const FIRST = 1e-3; // of them, over the last node

/** The energy of the curve `back` at the nodes, in units of x times y. */
export function storedEnergy({ x, back, dback, touch }) {
    let sum = touchEnergy(touch, x[1]);
    const stored = [0, sum];
    for (let i = 1; i < x.length - 1; i++) {
        const width = x[i + 1] - x[i];
        const bend = dback[i] - dback[i + 1];
        sum += (width * (back[i] + back[i + 1])) / 2 + (width ** 2 * bend) / 12;
        stored.push(sum);
    }
    return stored;
}

function touchEnergy(touch, x) {
    const [, b, c] = touch;
    const [y, slope] = firstTouch(touch, x);
    const power = (x * slope) / y;
    const rise = x * y ** 2 * (b / (2 * power + 1) + (2 * c * x) / (2 * power + 2));
    return (Math.PI * x * y - y + Math.log1p(y) + rise) / (2 * Math.PI);
}

/** The displacement z at which the way back opens and its slope, so that no energy is gained anywhere. */
export function shiftOf(law) {
    const { x, y, dy, ratio, dratio } = law;
    const h = y.map((load, i) => law.inverse(law.back, law.dback, load / ratio[i]));
    const z = x.map((place, i) => place - ratio[i] * h[i]);
    const dz = x.map((_, i) => {
        const [back, steep] = law.curve(law.back, law.dback, h[i]);
        const grows = steep > 0 ? (dy[i] - dratio[i] * back) / (ratio[i] * steep) : 1;
        return 1 - dratio[i] * h[i] - ratio[i] * grows;
    });
    return losing(law, z, dz, h);
}

/** z and dz raised where energy would be gained. */
function losing(law, z, dz, h) {
    const { x, ratio, dratio } = law;
    const phi = largestPhi(law, h.slice(1).map((end, i) => 1.01 * Math.max(h[i], end)));
    const slopes = dz.map((slope, i) => {
        const around = Math.max(phi[i - 1] ?? 0, phi[i] ?? 0);
        return Math.max(slope, -dratio[i] * around, 0);
    });
    const raised = [z[0]];
    for (let i = 0; i < phi.length; i++) {
        const width = x[i + 1] - x[i];
        const middle = (3 * (ratio[i + 1] - ratio[i])) / width - dratio[i] - dratio[i + 1];
        const rise = (width / 3) * (slopes[i] + slopes[i + 1] + Math.max(-middle * phi[i], 0));
        raised.push(Math.max(z[i + 1], raised[i] + rise));
    }
    return [raised, slopes];
}

/** The largest phi = h - 2 B(h)/back(h) up to each h. */
function largestPhi(law, h) {
    const end = law.x[law.x.length - 1];
    const u = geomspace(FIRST * end, Math.max(...h, end), SAMPLES);
    const back = u.map((place) => law.curve(law.back, law.dback, place)[0]);
    let energy = (u[0] * back[0]) / 2;
    let most = -Infinity;
    const phi = u.map((place, i) => {
        if (i) energy += ((place - u[i - 1]) * (back[i] + back[i - 1])) / 2;
        most = Math.max(most, place - (2 * energy) / back[i]);
        return most;
    });
    return h.map((place) => {
        const i = u.findIndex((own) => own >= place);
        return phi[i < 0 ? SAMPLES - 1 : i];
    });
}
