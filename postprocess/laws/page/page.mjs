/** The page: what is asked in its form, computed by law.mjs, shown as numbers and charts, and saved. */

import { exportLaw } from "./exports.mjs";
import { fitOf } from "./fits.mjs";
import { generalLaw, inDigits, inflated, jointOf, lawData, missedBySmallStrain } from "./law.mjs";

const $ = (id) => document.getElementById(id);
const POINTS = 300; // of a curve
const SLIDER = 3000; // of the slider
const FORM = ["diameter", "by", "fit", "take", "clearance", "length", "plane", "friction", "strain"];
const OF_BODIES = ["metal", "E", "nu", "yield", "slope", "flow"];
const FIELDS = [...FORM, ...["pin", "block"].flatMap((body) => OF_BODIES.map((name) => `${body}-${name}`)), "delta", "deepest"];
const FAR = 10; // PEEQ to which a straight line of hardening goes
// Left, right, top and bottom margin, and the size of a chart.
const BOX = { left: 72, right: 14, top: 30, bottom: 40, width: 420, height: 270 };

let data = null;
let shown = null; // the joint, its law, and what it is made of

const number = (id) => ($(id).value.trim() === "" ? null : Number($(id).value.replace(",", ".")));

/** A value to read: five digits, and thousands apart. */
function plain(value) {
    if (!Number.isFinite(value)) return "–";
    const text = inDigits(value, 5);
    const whole = Math.abs(value) >= 1e5 && Math.abs(value) < 1e10 ? Number(text).toFixed(0) : text;
    return /^-?\d{5,}(\.|$)/.test(whole) ? whole.replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f") : whole;
}

const degrees = (angle) => (angle * 180) / Math.PI;

/** A positive number of the form; throws a sentence for anything else. */
function positive(id, name) {
    const value = number(id);
    const fine = value !== null && value > 0 && Number.isFinite(value);
    $(id).setAttribute("aria-invalid", String(!fine));
    if (!fine) throw new RangeError(`${name} must be a positive number.`);
    return value;
}

// --- the joint

/** The body that the form describes: null for a rigid pin. */
function bodyOf(body) {
    const metal = $(`${body}-metal`).value;
    if (metal === "rigid") return null;
    if (metal === "own") {
        const E = positive(`${body}-E`, `E of the ${body}`);
        const nu = number(`${body}-nu`);
        if (number(`${body}-yield`) === null) return { E, nu: nu ?? NaN, yield: null };
        const strength = positive(`${body}-yield`, `The yield stress of the ${body}`);
        if (number(`${body}-slope`) === null || number(`${body}-slope`) === 0) return { E, nu: nu ?? NaN, yield: strength };
        const rise = positive(`${body}-slope`, `The hardening slope of the ${body}`);
        return { E, nu: nu ?? NaN, yield: strength, hardening: [[0, strength], [FAR, strength + FAR * rise]] };
    }
    const named = data.metals[metal];
    const flow = $(`${body}-flow`).value;
    const points = named.hardening;
    if (flow === "elastic") return { E: named.E, nu: named.nu, yield: null };
    if (flow === "perfect") return { E: named.E, nu: named.nu, yield: named.yield };
    return { E: named.E, nu: named.nu, yield: points[0][1], hardening: points };
}

/** The joint of the form, and its clearances [mm] at the limits of a fit. */
function asked() {
    const diameter = positive("diameter", "The diameter");
    const length = positive("length", "The length");
    let clearance = null;
    let limits = [];
    if ($("by").value === "fit") {
        $("fit").setAttribute("aria-invalid", "true");
        const fit = fitOf($("fit").value, diameter);
        const um = (value) => (value > 0 ? `+${value}` : String(value).replace("-", "−"));
        const range = (limits) => `${um(limits[1])}/${um(limits[0])}`;
        $("limits").textContent =
            `Hole ${range(fit.hole)} µm, shaft ${range(fit.shaft)} µm, clearance of diameters ${fit.least} to ${fit.largest} µm: ` +
            `dR = ${fit.least / 2000} to ${fit.largest / 2000} mm, here ${fit[$("take").value] / 2000} mm.`;
        clearance = fit[$("take").value] / 2000;
        limits = [fit.least / 2000, fit.largest / 2000];
        if (!(clearance > 0)) throw new RangeError(`${$("fit").value} has no clearance here: the law needs one.`);
        $("fit").setAttribute("aria-invalid", "false");
    } else {
        $("limits").textContent = "";
        clearance = positive("clearance", "The clearance");
    }
    const bodies = { pin: bodyOf("pin"), block: bodyOf("block") };
    const friction = number("friction") ?? 0;
    const ways = { plane: $("plane").value, friction, large_strain: $("strain").value === "large" };
    return { joint: jointOf({ radius: diameter / 2, clearance, length, ...ways, ...bodies }), limits };
}

/** The law of a joint with another clearance; null where there is none. */
function lawAt(joint, clearance) {
    try {
        return generalLaw(data, { ...joint, clearance });
    } catch (error) {
        if (error instanceof RangeError) return null;
        throw error;
    }
}

/** Show which fields matter, and what the metals are. */
function arrange() {
    for (const field of document.querySelectorAll("[data-by]")) field.hidden = field.dataset.by !== $("by").value;
    for (const body of ["pin", "block"]) {
        const metal = $(`${body}-metal`).value;
        for (const field of document.querySelectorAll(`[data-own=${body}]`)) field.hidden = metal !== "own";
        for (const field of document.querySelectorAll(`[data-named=${body}]`)) field.hidden = !(metal in data.metals);
        const { title, source } = data.metals[metal] ?? {};
        const named = data.metals[metal];
        $(`${body}-about`).textContent = title
            ? `${title}: E ${named.E} MPa, nu ${named.nu}, yield ${named.yield} MPa, tensile ${named.tensile} MPa. Source: ${source}.`
            : "";
    }
}

/** Compute the law of the form's joint, or say why there is none. */
function compute() {
    arrange();
    $("law").setAttribute("aria-busy", "false");
    try {
        const { joint, limits } = asked();
        const law = generalLaw(data, joint);
        shown = { joint, law, extremes: limits.map((clearance) => lawAt(joint, clearance)) };
    } catch (error) {
        if (!(error instanceof RangeError)) throw error;
        shown = null;
        $("refused").textContent = error.message;
    }
    $("refused").hidden = shown !== null;
    $("told").hidden = shown === null;
    warn();
    if (shown) {
        placeCursor();
        show();
    }
    remember();
}

const ROUGH_PRESSURE = "p0 of a joint with friction is off by some 3 %, and by 19 % at worst";

function warn() {
    const plastic = ["pin", "block"].filter((body) => {
        return $(`${body}-metal`).value in data.metals && $(`${body}-flow`).value === "perfect";
    });
    const said = [];
    if (plastic.length) {
        said.push(`Taken as perfectly plastic at the listed yield stress: ${plastic.join(" and ")}.`);
        said.push("The metals harden, so that beyond first yield the force is higher.");
    }
    const missed = shown ? missedBySmallStrain(shown.joint) : 0;
    if (missed) {
        said.push("Small strain leaves out that the block thickens where it yields.");
        said.push(`At 2 dR the force is about ${inDigits(100 * missed, 2)} % higher: choose large strain.`);
    }
    if (shown?.joint.friction) {
        said.push(`The expected error is of the force: ${ROUGH_PRESSURE}.`);
    }
    $("warned").hidden = !shown || said.length === 0;
    $("warned").textContent = said.join(" ");
}

// --- what is read off

/** The displacement that is read at; the slider's if the field is empty. */
function placeCursor() {
    const { law } = shown;
    const delta = number("delta");
    const inside = delta !== null && delta >= 0 && delta <= law.limit;
    if (!inside) $("delta").value = inDigits(law.limit / 3, 5);
    $("cursor").value = String(Math.round((SLIDER * number("delta")) / law.limit));
}

function deepestOf(law) {
    const deepest = number("deepest");
    const fine = deepest === null || (deepest >= 0 && deepest <= law.limit);
    $("deepest").setAttribute("aria-invalid", String(!fine));
    return fine && law.yields ? (deepest ?? 0) : 0;
}

/** Numbers and charts at the cursor. */
function show(from = "") {
    const { law, joint, extremes } = shown;
    const delta = number("delta");
    const deepest = deepestOf(law);
    const state = law.at(delta, deepest);
    const first = law.at(delta);
    const { length } = joint;
    if (from !== "load") $("load").value = inDigits(state.load * length, 6);
    $("cursor").setAttribute("aria-valuetext", `delta ${plain(delta)} mm, P ${plain(state.load * length)} N`);
    const share = state.load > 0 ? `${((100 * state.error) / state.load).toFixed(2)} %` : "";
    const yields = law.firstYield < law.limit;
    const opens = law.residual(Math.max(deepest, delta));
    const residual = opens > 1e-9 * joint.clearance ? opens : 0; // not round-off
    const rows = [
        [delta < deepest ? "Force P on the way back" : "Force P", `${plain(state.load * length)} N`, ""],
        ["Expected error of P", `± ${plain(state.error * length)} N`, share],
        ["Stiffness dP/d(delta)", `${plain(state.stiffness * length)} N/mm`, ""],
        ["Peak pressure p0", `${plain(first.peak)} MPa`, delta < deepest ? "on first loading" : ""],
        ["Contact semi-angle eps", `${plain(degrees(first.angle))}°`, delta < deepest ? "on first loading" : ""],
        ["Read at delta", `${plain(delta)} mm`, `${plain(delta / joint.clearance)} dR`],
        ["First yield about at", yields ? `${plain(law.firstYield)} mm` : "none to 3 dR", yields ? `P ${plain(law.at(law.firstYield).load * length)} N` : ""],
        ["Residual clearance", `${plain(residual)} mm`, `back from ${plain(Math.max(deepest, delta))} mm`],
    ];
    for (const [i, own] of extremes.entries()) {
        const load = own && delta <= own.limit ? `${plain(own.at(delta).load * length)} N` : "outside the law";
        rows.push([`First loading, ${i ? "largest" : "least"} clearance`, load, "at this delta"]);
    }
    $("values").replaceChildren(...rows.map(([name, value, more]) => {
        const box = document.createElement("div");
        const note = Object.assign(document.createElement("small"), { textContent: more && ` ${more}` });
        const said = Object.assign(document.createElement("dd"), { textContent: value });
        said.append(note);
        box.append(Object.assign(document.createElement("dt"), { textContent: name }), said);
        return box;
    }));
    $("band").textContent =
        "Solid: first loading, with the band within which 9 in 10 such joints are. " +
        (deepest ? "Dashed: the way back. " : "") + (yields ? "Dotted: about first yield. " : "") + "All curves end at 3 dR.";
    draw();
}

// --- charts

const CHARTS = [
    { title: "Force P [N]", of: (state, { length }) => state.load * length, band: (state, { length }) => state.error * length, back: true },
    { title: "Peak pressure p0 [MPa]", of: (state) => state.peak },
    { title: "Contact semi-angle eps [°]", of: (state) => degrees(state.angle) },
    { title: "Stiffness dP/d(delta) [N/mm]", of: (state, { length }) => state.stiffness * length, back: true },
    { title: "Expected error of P [N]", of: (state, { length }) => state.error * length, back: true },
];

/** Rows of all quantities, first loading and way back, at equal steps. */
function sampled(deepest) {
    const { law } = shown;
    const places = Array.from({ length: POINTS + 1 }, (_, i) => (law.limit * i) / POINTS);
    const first = places.map((delta) => ({ delta, ...law.at(delta) }));
    const nearly = deepest * (1 - 1e-12); // where the way back has its own stiffness and error
    const back = places.map((place) => {
        const delta = Math.max(place / law.limit, 1e-12) * nearly;
        return { delta, ...law.at(delta, deepest) };
    });
    return { first, back: deepest ? back : [] };
}

/** Round steps of an axis up to `most`. */
function ticks(most, count = 5) {
    const rough = most / count;
    const unit = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].find((factor) => factor * unit >= rough) * unit;
    return Array.from({ length: Math.floor(most / step + 1e-9) + 1 }, (_, i) => i * step);
}

function draw() {
    const { law, joint } = shown;
    const deepest = deepestOf(law);
    const { first, back } = sampled(deepest);
    const delta = number("delta");
    const { left, right, top, bottom, width, height } = BOX;
    const inner = { width: width - left - right, height: height - top - bottom };
    const X = (place) => left + (inner.width * place) / law.limit;
    const pictures = CHARTS.map((chart) => {
        const value = (state) => chart.of(state, joint);
        const error = (state) => (chart.band ? chart.band(state, joint) : 0);
        const most = 1.05 * Math.max(...first.map((state) => value(state) + error(state)), ...(chart.back ? back.map(value) : []));
        const Y = (height_) => height - bottom - (inner.height * Math.max(height_, 0)) / most;
        const line = (states, of) => states.map((state) => `${X(state.delta).toFixed(1)},${Y(of(state)).toFixed(1)}`).join(" ");
        const upper = line(first, (state) => value(state) + error(state));
        const lower = line([...first].reverse(), (state) => value(state) - error(state));
        const above = line(back, (state) => value(state) + error(state));
        const below = line([...back].reverse(), (state) => value(state) - error(state));
        const state = law.at(delta, chart.back ? deepest : 0);
        const onBack = chart.back && delta < deepest ? " on-back" : "";
        return `<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="${chart.title} by delta; ${plain(value(state))} at ${plain(delta)} mm">
<text class="title" x="${left}" y="18">${chart.title}</text>
<text text-anchor="end" x="${width - right}" y="18">${plain(value(state))}</text>
${ticks(most).map((at) => `<path class="grid" d="M${left} ${Y(at)}H${width - right}"/><text text-anchor="end" x="${left - 6}" y="${Y(at) + 4}">${plain(at)}</text>`).join("")}
${ticks(law.limit).map((at) => `<path class="grid" d="M${X(at)} ${top}V${height - bottom}"/><text text-anchor="middle" x="${X(at)}" y="${height - bottom + 16}">${inDigits(at, 4)}</text>`).join("")}
<text text-anchor="end" x="${width - right}" y="${height - 6}">delta [mm]</text>
<path class="axis" d="M${left} ${top}V${height - bottom}H${width - right}"/>
${chart.band ? `<polygon class="band" points="${upper} ${lower}"/><polygon class="back-band" points="${above} ${below}"/>` : ""}
${law.firstYield < law.limit ? `<path class="yield" d="M${X(law.firstYield)} ${top}V${height - bottom}"/>` : ""}
<polyline class="first" points="${line(first, value)}"/>
${chart.back && back.length ? `<polyline class="back" points="${line(back, value)}"/>` : ""}
<path class="cursor" d="M${X(delta)} ${top}V${height - bottom}"/><circle class="dot${onBack}" r="4.5" cx="${X(delta)}" cy="${Y(value(state))}"/>
</svg>`;
    });
    $("charts").innerHTML = pictures.join("");
}

/** Move the cursor to where the pointer is in a chart. */
function follow(event) {
    const chart = event.target.closest("svg");
    if (!chart || (event.type === "pointermove" && event.pointerType !== "mouse" && !event.buttons)) return;
    const { left, width } = chart.getBoundingClientRect();
    const place = ((event.clientX - left) / width) * BOX.width - BOX.left;
    const share = Math.min(Math.max(place / (BOX.width - BOX.left - BOX.right), 0), 1);
    moveTo(share * shown.law.limit);
}

function moveTo(delta) {
    $("delta").value = inDigits(delta, 5);
    placeCursor();
    show();
    remember();
}

// --- saving

function save(suffix) {
    const { joint, law } = shown;
    if (suffix === ".png") savePicture();
    else if (suffix === ".csv") download(table(), "text/csv", suffix);
    else download(exportLaw(data, law, about(), suffix, "pin_joint", joint), "text/plain", suffix);
}

function about() {
    const { joint, law } = shown;
    const given = Object.entries(joint).filter(([name, value]) => value || (value === 0 && name !== "friction"));
    const most = (end) => Math.max(...law.error.filter((_, i) => law.x[i] >= 0.1 && law.x[i] <= end));
    const percent = (value) => `${(100 * value).toFixed(2)}%`;
    let error = `9 in 10 such joints are within ${percent(most(2))} of P from 0.1 to 2 dR, ${percent(most(3))} to 3 dR`;
    if (law.yields) error += `, and on the way back within ${percent(Math.max(...law.back_error))} of the largest P`;
    if (joint.friction) error += `; ${ROUGH_PRESSURE}`;
    return {
        title: `a pin joint in plane ${joint.plane}, by archord's law of solved joints`,
        archord: data.version,
        joint: Object.fromEntries(given),
        outside: "nothing: inside the range of solved joints",
        "expected error": error,
        units: { length: "mm", force: "N", stress: "MPa" },
    };
}

function table() {
    const { joint, law } = shown;
    const deepest = deepestOf(law);
    const { first, back } = sampled(deepest);
    const row = (way, s) => [way, s.delta, s.load * joint.length, s.stiffness * joint.length, s.error * joint.length, s.peak, degrees(s.angle)];
    const rows = [...first.map((s) => row("first loading", s)), ...back.reverse().map((s) => row(`back from ${deepest}`, s))];
    const head = "way,delta [mm],P [N],stiffness [N/mm],expected error [N],p0 [MPa],eps [deg]";
    return [head, ...rows.map((values) => values.map((value) => (Number.isNaN(value) ? "" : value)).join(","))].join("\n") + "\n";
}

function download(content, type, suffix) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
    link.download = `pin_joint${suffix}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** All charts in one picture, twice as large, in the page's colours. */
async function savePicture() {
    const charts = [...document.querySelectorAll("#charts svg")];
    const rows = Math.ceil(charts.length / 2);
    const canvas = Object.assign(document.createElement("canvas"), { width: 4 * BOX.width, height: 2 * rows * BOX.height });
    const pen = canvas.getContext("2d");
    pen.fillStyle = getComputedStyle(document.body).backgroundColor;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    const style = document.querySelector("style").textContent.replace(":root", "svg").replace(":root", "svg");
    for (const [i, chart] of charts.entries()) {
        const copy = chart.cloneNode(true);
        copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
        copy.setAttribute("width", 2 * BOX.width);
        copy.setAttribute("height", 2 * BOX.height);
        copy.prepend(Object.assign(document.createElementNS("http://www.w3.org/2000/svg", "style"), { textContent: style }));
        const image = new Image();
        image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
        await image.decode();
        pen.drawImage(image, (i % 2) * 2 * BOX.width, Math.floor(i / 2) * 2 * BOX.height);
    }
    canvas.toBlob((blob) => download(blob, "image/png", ".png"));
}

// --- state in the address

function remember() {
    const state = new URLSearchParams(FIELDS.map((id) => [id, $(id).value]).filter(([id, value]) => value && !$(id).hidden));
    history.replaceState(null, "", `#${state}`);
}

function recall() {
    for (const [id, value] of new URLSearchParams(location.hash.slice(1))) {
        if (!FIELDS.includes(id)) continue;
        const known = [...($(id).options ?? [])];
        if (!known.length || known.some((option) => option.value === value)) $(id).value = value;
    }
}

let waiting = 0;
function computeSoon() {
    clearTimeout(waiting);
    $("law").setAttribute("aria-busy", "true");
    waiting = setTimeout(compute, 150);
}

async function start() {
    const [words, joints] = await Promise.all(["words", "joints"].map((id) => inflated($(id).textContent)));
    data = lawData(JSON.parse(new TextDecoder().decode(words)), joints);
    recall();
    $("joint").addEventListener("input", computeSoon);
    $("joint").addEventListener("submit", (event) => event.preventDefault());
    $("cursor").addEventListener("input", () => moveTo((Number($("cursor").value) / SLIDER) * shown.law.limit));
    $("delta").addEventListener("change", () => moveTo(number("delta")));
    $("load").addEventListener("change", () => {
        const delta = shown.law.displacement(number("load") / shown.joint.length);
        $("load").setAttribute("aria-invalid", String(Number.isNaN(delta)));
        if (!Number.isNaN(delta)) moveTo(delta);
    });
    $("deepest").addEventListener("input", () => { show(); remember(); });
    for (const kind of ["pointerdown", "pointermove"]) $("charts").addEventListener(kind, follow);
    for (const button of document.querySelectorAll("[data-save]")) button.addEventListener("click", () => save(button.dataset.save));
    $("share").addEventListener("click", async () => {
        const copied = await navigator.clipboard.writeText(location.href).then(() => true, () => false);
        $("copied").textContent = copied ? "copied" : "not allowed here: copy the address of this page";
    });
    window.addEventListener("hashchange", () => { recall(); compute(); });
    compute();
}

start();
