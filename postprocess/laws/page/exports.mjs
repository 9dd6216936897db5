/** The law of one joint as a file: the texts of archord's exports, whose open places are filled here. */

import { shiftOf, storedEnergy } from "./dents.mjs";

/** JSON with the blanks that Python's json.dumps leaves; other words for a value by `words`. */
function spaced(value, words = {}) {
    const told = (own) => spaced(own, words);
    if (Array.isArray(value)) return `[${value.map(told).join(", ")}]`;
    if (typeof value === "string") return JSON.stringify(value);
    if (value === null || typeof value !== "object") return words[value] ?? JSON.stringify(value);
    return `{${Object.entries(value).map(([key, own]) => `${JSON.stringify(key)}: ${told(own)}`).join(", ")}}`;
}

/** A literal of Python. */
const literal = (value) => spaced(value, { true: "True", false: "False", null: "None" });

/** A number as Python prints it. */
function exact(value) {
    const text = String(value);
    if (/^-?\d+$/.test(text)) return `${text}.0`;
    return text.replace(/e([+-])(\d)$/, "e$10$2");
}

/** Lines of at most 110 letters; later ones begin with `indent`. */
function wrapped(text, indent = "") {
    const lines = [""];
    for (const word of text.split(/\s+/)) {
        const line = lines[lines.length - 1];
        const longer = line ? `${line} ${word}` : (lines.length > 1 ? indent : "") + word;
        if (longer.length > 110 && line.trim()) lines.push(indent + word);
        else lines[lines.length - 1] = longer;
    }
    return lines.join("\n");
}

const filled = (form, words) =>
    form.replace(/\{\{|\}\}|\{(\w+)\}/g, (mark, word) => (word ? words[word] : mark[0]));

const QUOTED = {
    ".py": literal,
    ".mjs": (about) => spaced(about),
    ".h": (about) => JSON.stringify(spaced(about)),
    ".mo": (about) => JSON.stringify(spaced(about)),
    ".m": (about) => `'${spaced(about).replaceAll("'", "''")}'`,
};

/** The tables in the joint's units, by the names of the exports. */
function tablesOf(law, radius, pinLength) {
    const { length, pressure, x } = law;
    const force = law.force * pinLength;
    const root = Math.sqrt(force);
    const times = (values, factor) => values.map((value) => value * factor);
    const [shift, shiftSlope] = shiftOf(law);
    return {
        RANGE: length * x[x.length - 1],
        REACH: length * (1 + 1e-9) * x[x.length - 1],
        LENGTH: length,
        FORCE: force,
        WIDEST: law.widest,
        RADIUS: radius,
        SHIFT: times(shift, length),
        SHIFT_SLOPE: shiftSlope,
        STORED: times(storedEnergy(law), length * force),
        PIN_LENGTH: pinLength,
        NODES: times(x, length),
        LOAD: times(law.y, force),
        LOAD_SLOPE: times(law.dy, force / length),
        BACK: times(law.back, force),
        BACK_SLOPE: times(law.dback, force / length),
        RATIO: law.ratio,
        RATIO_SLOPE: times(law.dratio, 1 / length),
        TOE: times(law.toe, length),
        TOUCH: law.touch,
        PEAK: times(law.peak, pressure / root),
        PEAK_SLOPE: times(law.dpeak, pressure / root / length),
        ANGLE: times(law.angle, 1 / root),
        ANGLE_SLOPE: times(law.dangle, 1 / root / length),
        ERROR: law.error,
        BACK_ERROR: law.back_error,
    };
}

/** The text of a file with the law of a joint; `about` says what it is the law of, from the title on. */
export function exportLaw(data, law, about, suffix, name, { radius, length }) {
    const { forms, paragraphs, texts, rules, units } = data.exports;
    const kind = law.yields ? "yields" : "elastic";
    const form = forms[suffix];
    const of = length === 1 ? units[0] : units[1].replaceAll("@length@", String(length));
    const said = Object.entries(about).slice(1).map(([key, value]) => {
        return wrapped(`${key}: ${typeof value === "string" ? value : spaced(value)}`, "    ");
    });
    const header = [about.title, "", ...said, "", wrapped(of), "", wrapped(rules[kind])].join("\n");
    const words = { name, title: about.title, header, about: QUOTED[suffix](about) };
    for (const [key, value] of Object.entries(tablesOf(law, radius, length))) {
        const rows = [];
        const numbers = [value].flat().map(exact);
        for (let i = 0; i < numbers.length; i += 5) rows.push(numbers.slice(i, i + 5).join(", "));
        const place = Array.isArray(value) ? form.table : form.number;
        words[key] = filled(place, { name, key, n: numbers.length, value: rows.join(form.line_end) });
    }
    const text = texts[kind][suffix].map((place) => paragraphs[place]).join("\n\n");
    return text.replace(/@(\w+)@/g, (mark, word) => words[word] ?? mark);
}
