/**
 * The law of any pin joint: force, pressure, contact angle, way back and expected error by displacement.
 *
 * A port of archord's postprocess/laws/general, whose docstrings have the equations and their sources: elastic_model.py,
 * gaussian_process.py, yield_model.py, hardening_model.py, general_law.py and joint_curve.py, in this order; factor_model.py
 * is in factors.mjs. Numbers come from the same files; tests compare the two.
 */

import { addedBy } from "./factors.mjs";

// --- numbers

/** `count` numbers from `first` to `last` in equal ratios. */
export function geomspace(first, last, count) {
    const a = Math.log10(first);
    const step = (Math.log10(last) - a) / (count - 1);
    const inner = Array.from({ length: count - 2 }, (_, i) => 10 ** (a + (i + 1) * step));
    return [first, ...inner, last];
}

const clip = (value, low, high) => Math.min(Math.max(value, low), high);

/** The last i below the last node with nodes[i] <= x, or 0. */
function interval(nodes, x) {
    let low = 0;
    let high = nodes.length - 1;
    while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (nodes[middle] <= x) low = middle;
        else high = middle;
    }
    return low;
}

/** Straight between the points (nodes, values), constant beyond them. */
function straight(x, nodes, values) {
    const last = nodes.length - 1;
    if (x >= nodes[last]) return values[last];
    if (x <= nodes[0]) return values[0];
    const i = interval(nodes, x);
    return values[i] + ((values[i + 1] - values[i]) / (nodes[i + 1] - nodes[i])) * (x - nodes[i]);
}

const accumulate = (values, choose) => {
    let most = values[0];
    return values.map((value) => (most = choose(most, value)));
};
const maximum = (a, b) => Math.max(a, b);

/** The cubic between two nodes at x, and its slope; straight on beyond the ends. */
function hermite(nodes, f, df, x) {
    const i = interval(nodes, x);
    const inside = clip(x, nodes[0], nodes[nodes.length - 1]);
    const piece = pieceOf(nodes, f, df, i);
    const [value, rise] = cubicAt(piece, (inside - nodes[i]) / piece.width);
    const slope = rise / piece.width;
    return [value + slope * (x - inside), slope];
}

function pieceOf(nodes, f, df, i) {
    const width = nodes[i + 1] - nodes[i];
    const rise = f[i + 1] - f[i];
    const first = width * df[i];
    const end = width * df[i + 1];
    return { width, f: f[i], first, second: 3 * rise - 2 * first - end, third: first + end - 2 * rise };
}

function cubicAt({ f, first, second, third }, t) {
    return [f + t * (first + t * (second + t * third)), first + t * (2 * second + t * 3 * third)];
}

/** Slopes at the nodes of the cubic spline, which begins with slope 0 (`clamped`) or as the other end: not a knot. */
function splineSlopes(x, values, clamped) {
    const n = x.length;
    const h = x.slice(1).map((end, i) => end - x[i]);
    const secant = h.map((width, i) => (values[i + 1] - values[i]) / width);
    if (n === 2) return [clamped ? 0 : secant[0], secant[0]];
    const low = new Array(n).fill(0);
    const middle = new Array(n).fill(1);
    const high = new Array(n).fill(0);
    const right = new Array(n).fill(0);
    for (let i = 1; i < n - 1; i++) {
        low[i] = h[i];
        middle[i] = 2 * (h[i - 1] + h[i]);
        high[i] = h[i - 1];
        right[i] = 3 * (h[i] * secant[i - 1] + h[i - 1] * secant[i]);
    }
    if (!clamped) {
        const both = x[2] - x[0];
        middle[0] = h[1];
        high[0] = both;
        right[0] = ((h[0] + 2 * both) * h[1] * secant[0] + h[0] ** 2 * secant[1]) / both;
    }
    const both = x[n - 1] - x[n - 3];
    middle[n - 1] = h[n - 3];
    low[n - 1] = both;
    right[n - 1] = (h[n - 2] ** 2 * secant[n - 3] + (2 * both + h[n - 2]) * h[n - 3] * secant[n - 2]) / both;
    for (let i = 1; i < n; i++) {
        const factor = low[i] / middle[i - 1];
        middle[i] -= factor * high[i - 1];
        right[i] -= factor * right[i - 1];
    }
    for (let i = n - 1; i >= 0; i--) {
        const beyond = i < n - 1 ? high[i] * right[i + 1] : 0;
        right[i] = (right[i] - beyond) / middle[i];
    }
    return right;
}

/** Slopes of cubics that rise and fall where the values do (Fritsch and Butland 1984). */
function pchipSlopes(x, values) {
    const h = x.slice(1).map((end, i) => end - x[i]);
    const m = h.map((width, i) => (values[i + 1] - values[i]) / width);
    const inner = m.slice(1).map((after, i) => {
        const before = m[i];
        if (!(before * after > 0)) return 0;
        const one = 2 * h[i + 1] + h[i];
        const other = h[i + 1] + 2 * h[i];
        return (one + other) / (one / before + other / after);
    });
    const last = m.length - 1;
    return [endSlope(h[0], h[1], m[0], m[1]), ...inner, endSlope(h[last], h[last - 1], m[last], m[last - 1])];
}

function endSlope(h0, h1, m0, m1) {
    const slope = ((2 * h0 + h1) * m0 - h0 * m1) / (h0 + h1);
    if (Math.sign(slope) !== Math.sign(m0)) return 0;
    if (Math.sign(m0) !== Math.sign(m1) && Math.abs(slope) > 3 * Math.abs(m0)) return 3 * m0;
    return slope;
}

// --- the elastic joint

const FARTHEST = 3.8; // delta/dR at the end of the polynomials
const CLEARANCE = 0.02; // the dR/R in which dR/R is counted
const ITERATIONS = 6; // of Newton's method for line contact

/** y and dy/dx where F(x) and its slope are these: t = 1/y solves pi x t - ln(1 + t) = F. */
function lineContact(x, F, slope) {
    const line = Math.PI * x;
    let t = (F + Math.log1p(F / line)) / line;
    for (let i = 0; i < ITERATIONS; i++) {
        const miss = line * t - Math.log1p(t) - F;
        t -= miss / (line - 1 / (1 + t));
    }
    return [1 / t, (Math.PI - slope / t) / (line * t - t / (1 + t))];
}

/** Chebyshev's coefficients of a function of x/(1 + x): rows are exponents of p, p m, q n, dR/R, and coefficients. */
function seriesOf(rows, { p, m, n, clearance }) {
    const factors = [p, p * m, (1 - p) * n, clearance / CLEARANCE];
    const series = new Array(rows[0].length - 4).fill(0);
    for (const row of rows) {
        const product = factors.reduce((all, factor, i) => all * factor ** row[i], 1);
        for (let k = 0; k < series.length; k++) series[k] += product * row[k + 4];
    }
    return series;
}

function chebyshev(c, t) {
    let one = 0;
    let two = 0;
    for (let k = c.length - 1; k > 0; k--) [one, two] = [c[k] + 2 * t * one - two, one];
    return c[0] + t * one - two;
}

function chebyshevSlope(c) {
    const from = [...c];
    const slope = new Array(c.length - 1);
    for (let k = c.length - 1; k > 2; k--) {
        slope[k - 1] = 2 * k * from[k];
        from[k - 2] += (k * from[k]) / (k - 2);
    }
    slope[1] = 4 * from[2];
    slope[0] = from[1];
    return slope;
}

/** The elastic joint: y, dy/dx, p0 R/(E* dR) and eps [rad] at x. */
function elasticJoint(tables, joint) {
    const [F, peak, angle] = ["F", "peak", "angle"].map((name) => seriesOf(tables[name], joint));
    const slope = chebyshevSlope(F);
    const depth = (x) => ((2 * (x / (1 + x)) * (1 + FARTHEST)) / FARTHEST) - 1;
    const touch = (x) => chebyshev(F, depth(x));
    const at = (x) => {
        const t = depth(x);
        const level = chebyshev(F, t);
        const rise = chebyshev(slope, t) * ((2 * (1 + FARTHEST)) / FARTHEST / (1 + x) ** 2);
        const [y, dy] = lineContact(x, level, rise);
        const root = Math.sqrt(y);
        return { y, slope: dy, peak: chebyshev(peak, t) * root, angle: chebyshev(angle, t) * root };
    };
    return { ...joint, at, touch };
}

// --- Gaussian processes

/** The lower factor of a symmetric positive matrix, in place: rows of n in one array. */
function cholesky(A, n) {
    for (let i = 0; i < n; i++) {
        const row = A.subarray(i * n, i * n + n);
        for (let j = 0; j <= i; j++) {
            const other = A.subarray(j * n, j * n + n);
            const rest = row[j] - dot(row, other, j);
            row[j] = i === j ? Math.sqrt(rest) : rest / other[j];
        }
    }
    return A;
}

/** The sum of products of the first `count` entries, in four sums. */
function dot(a, b, count) {
    const whole = count - (count % 4);
    let s0 = 0;
    let s1 = 0;
    let s2 = 0;
    let s3 = 0;
    for (let k = 0; k < whole; k += 4) {
        s0 += a[k] * b[k];
        s1 += a[k + 1] * b[k + 1];
        s2 += a[k + 2] * b[k + 2];
        s3 += a[k + 3] * b[k + 3];
    }
    for (let k = whole; k < count; k++) s0 += a[k] * b[k];
    return s0 + s1 + (s2 + s3);
}

/** The solution of L u = right, for the first `count` rows of the factor L of n. */
function forward(L, n, right, count) {
    const u = new Float64Array(count);
    for (let i = 0; i < count; i++) {
        const row = L.subarray(i * n, i * n + i + 1);
        u[i] = (right[i] - dot(row, u, i)) / row[i];
    }
    return u;
}

/** The covariance of two points: Matern's of order 7/2, beside a linear mean. */
function covariance({ lengths }, one, other) {
    let distance = 0;
    let mean = 1;
    for (let k = 0; k < lengths.length; k++) {
        distance += ((one[k] - other[k]) / lengths[k]) ** 2;
        mean += one[k] * other[k];
    }
    const r = Math.sqrt(7 * distance);
    return (1 + r * (1 + r * (0.4 + r / 15))) * Math.exp(-r) + mean;
}

/** A process through `values[j]`, which are known of the first points, as many as they are. */
function gaussianProcess(kernel, points, values) {
    const n = points.length;
    const A = new Float64Array(n * n);
    for (let i = 0; i < n; i++) {
        for (let j = 0; j <= i; j++) A[i * n + j] = covariance(kernel, points[i], points[j]);
        A[i * n + i] += kernel.noise;
    }
    const L = cholesky(A, n);
    const weights = values.map((known) => forward(L, n, known, known.length));
    const sizes = weights.map((w) => dot(w, w, w.length) / Math.max(w.length, 1));
    /** Means and standard deviations of all values at a point. */
    return (point) => {
        const covariances = points.map((known) => covariance(kernel, known, point));
        const reduced = forward(L, n, covariances, n);
        const prior = point.reduce((sum, value) => sum + value ** 2, 2);
        const means = weights.map((w) => dot(reduced, w, w.length));
        const deviations = weights.map((w, j) => {
            const left = Math.max(prior - dot(reduced, reduced, w.length), 0) + kernel.noise;
            return Math.sqrt(left * sizes[j]);
        });
        return [means, deviations];
    };
}

// --- what yielding does

const GRID = geomspace(0.03, 3.8, 300); // x, among which first yield is found
const ELASTIC_BELOW = 0.8; // x/x0: nothing has yielded
const STRONGER = { strain: [0.5, 0.8], stress: [1 - Math.sqrt(0.75), 0.2] }; // parts within which the other body matters
const FELT = 0.3; // exponent of what a yielded pin leaves
const DEEPER = 3; // x/x0 where that is asked
const BLENDED = 0.05; // ln of the block's s over the pin's, up to which the processes of two sides are mixed
const NINE_IN_TEN = 1.645; // standard deviations
const PIN_ALONE = "strain pin alone";
const PIN_WEAKER = "strain pin weaker";

/** The share of joints with the weaker pin in what is told: 0 of a weaker block and of like bodies. */
function shareOfPin({ pin, block }) {
    if (!(pin < block) || alike(pin, block)) return 0;
    return smoothStep(Math.log(block / pin) / BLENDED);
}

/** From 0 for t <= 0 to 1 for t >= 1, without a kink. */
function smoothStep(t) {
    const inside = clip(t, 0, 1);
    return inside ** 2 * (3 - 2 * inside);
}

const alike = (a, b) => a === b || (Number.isFinite(b) && Math.abs(a - b) <= 1e-8 + 1e-4 * Math.abs(b));
const tellsOfPin = (side) => side === PIN_ALONE || side === "stress pin";
const ownStress = (side, { pin, block }) => (tellsOfPin(side) ? pin : block);

/** About the x of first yield by s, where the elastic p0, times what is left of it, is g sigY. */
function yieldAt(strain, elastic, left = GRID.map(() => 1)) {
    const pressures = (elastic.pressures ??= GRID.map((x) => elastic.at(x).peak));
    const over = GRID.map((x, i) => {
        const g = 0.95 + (strain ? 0.5 : 0.12) * Math.exp(-x / 0.35);
        return (left[i] * pressures[i]) / g;
    });
    const nodes = accumulate(over, maximum).map(Math.log);
    const x = GRID.map(Math.log);
    return (s) => (s === Infinity ? Infinity : Math.exp(straight(Math.log(s), nodes, x)));
}

/** The inputs of the process of a side; the last ones tell how much stronger the other body is, and what is lost to it. */
function features(side, { p, m, n, clearance }, stresses, lost) {
    const s = ownStress(side, stresses);
    const inputs = [p, p * m, (1 - p) * n, Math.log(clearance / 0.005) / 1.5, Math.log(s)];
    if (side === PIN_WEAKER) return [...inputs, Math.log(stresses.pin / s), lost];
    if (side === PIN_ALONE) return inputs;
    const share = s / (side === "stress pin" ? stresses.block : stresses.pin);
    const within = STRONGER[side.split(" ")[0]];
    return [...inputs, ...within.map((part) => Math.min((1 - share) / part, 1))];
}

const KINDS = ["both", "weaker", "weaker", "alone"]; // of joints, in which errors scatter unlike
const APART = [0, 0.1, 0.9, 1]; // where they are, from bodies as strong as each other to an elastic one
const SOFTER = [0.45, 0.5]; // p m between which a pin comes to count as soft

/** The factor on standard deviations of P of a joint with these features. */
function scatterOf(side, inputs, spread) {
    const own = side === PIN_WEAKER ? Math.min(-inputs[5], APART[2]) : inputs[5];
    const apart = side === PIN_ALONE ? 1 : own;
    const soft = straight(inputs[1], SOFTER, [1, spread.soft]);
    return soft * straight(apart, APART, KINDS.map((kind) => spread[kind]));
}

/** The three processes of a side: of force, of pressure and angle, and of the way back. */
function processesOf(data, side) {
    const { joints, kernels } = data;
    const chosen = joints.flatMap((joint, row) => (joint.side === side ? [{ ...joint, row }] : []));
    chosen.sort((a, b) => b.known - a.known || a.x0 - b.x0 || a.row - b.row);
    const inputs = chosen.map((joint) => features(side, joint, joint, joint.lost));
    const columns = (name) =>
        data.multiples.map((_, k) => chosen.filter((joint) => joint.known > k).map((joint) => joint[name][k]));
    const places = new Map(chosen.map((joint, place) => [joint.row, place]));
    const back = data.back.filter(([row, u]) => places.has(row) && u > ELASTIC_BELOW);
    const deep = back.map(([row, u]) => [...inputs[places.get(row)], Math.log(u)]);
    const again = back.findIndex((row) => Number.isNaN(row[5]));
    const told = [2, 3, 4, 5].map((k) => back.map((row) => row[k] - (k === 2 ? 1 : 0)));
    told[3] = told[3].slice(0, again < 0 ? back.length : again);
    const own = kernels[side].kernels;
    return {
        spread: kernels[side].spread,
        force: gaussianProcess(own.force, inputs, columns("force")),
        shape: gaussianProcess(own.shape, inputs, [...columns("peak"), ...columns("angle")]),
        back: gaussianProcess(own.back, deep, told),
    };
}

/** How many of the multiples are known up to `most` x0, and one beyond. */
const knownTo = (multiples, most) => Math.min(multiples.filter((u) => u < most).length + 1, multiples.length);

/** The curves of one joint over u = ln(x/x0): force, its slope, peak, angle, deviation. */
function curvesOf(data, told, inputs, most) {
    const known = knownTo(data.multiples, most);
    const [force, deviation] = told.force(inputs);
    const [shape] = told.shape(inputs);
    const count = data.multiples.length;
    const at = [ELASTIC_BELOW, ...data.multiples.slice(0, known)].map(Math.log);
    const nodes = [force, shape.slice(0, count), shape.slice(count), deviation].map((f) => [0, ...f.slice(0, known)]);
    const slopes = nodes.slice(0, 3).map((f) => splineSlopes(at, f, true));
    return (u) => {
        if (!(u > at[0])) return { force: 0, slope: 0, peak: 0, angle: 0, deviation: 0 };
        const [[f, slope], [peak], [angle]] = slopes.map((df, i) => splineAt(at, nodes[i], df, u));
        return { force: f, slope, peak, angle, deviation: straight(u, at, nodes[3]) };
    };
}

/** As hermite, but beyond the ends the cubics go on. */
function splineAt(nodes, f, df, x) {
    const i = interval(nodes, x);
    const piece = pieceOf(nodes, f, df, i);
    const [value, rise] = cubicAt(piece, (x - nodes[i]) / piece.width);
    return [value, rise / piece.width];
}

/** What the model of one side says at the nodes x, where the bodies have these stresses (one for all, or one a node). */
function sideLoss(data, side, elastic, stresses, x, onset) {
    const told = (data.processes[side] ??= processesOf(data, side));
    const most = Math.max(...x.map((place, i) => place / onset(stresses[i]).x0));
    let curves = null;
    let inputs = null;
    return x.map((place, i) => {
        const own = stresses[i];
        const { x0, lost } = onset(own);
        if (own !== stresses[i - 1]) {
            inputs = features(side, elastic, own, lost);
            curves = curvesOf(data, told, inputs, most);
        }
        const u = Math.log(place / x0);
        const [[travel, toe, misfit, again], [uncertain]] = told.back([...inputs, u]);
        const state = curves(u);
        const wayError = Math.hypot(told.spread.back * uncertain, NINE_IN_TEN * misfit, again);
        const begun = clip(Math.log(place / (ELASTIC_BELOW * x0)) / 0.2, 0, 1);
        const deviation = scatterOf(side, inputs, told.spread.force) * state.deviation;
        return { ...state, slope: state.slope / place, deviation, travel: 1 + travel, toe, wayError, begun };
    });
}

const NO_LOSS = { force: 0, slope: 0, deviation: 0, peak: 0, angle: 0, travel: 1, toe: 0, wayError: 0 };

/** The sum of what the models of a side tell at the nodes; each begins where its body yields. */
function totalLoss(data, side, strain, elastic, stresses, x) {
    let total = x.map(() => NO_LOSS);
    for (const model of side === PIN_WEAKER ? [PIN_ALONE, PIN_WEAKER] : [side]) {
        const peaks = total.map((state) => state.peak);
        const onset = onsetOf(model, strain, elastic, x, peaks);
        if (stresses.every((own) => ELASTIC_BELOW * onset(own).x0 >= x[x.length - 1])) continue;
        const added = sideLoss(data, model, elastic, stresses, x, onset);
        total = total.map((sum, i) => {
            const own = added[i];
            const mixed = (name) => sum[name] + own.begun * (own[name] - sum[name]);
            return {
                force: sum.force + own.force,
                slope: sum.slope + own.slope,
                deviation: Math.hypot(sum.deviation, own.deviation, own.begun * data.solved[model]),
                peak: sum.peak + own.peak,
                angle: sum.angle + own.angle,
                travel: mixed("travel"),
                toe: mixed("toe"),
                wayError: mixed("wayError"),
            };
        });
    }
    return total;
}

/** By stresses: about the x of first yield, and how far ln(p0/p0_el) is lost to a weaker pin some way beyond. */
function onsetOf(side, strain, elastic, x, peaks) {
    if (side !== PIN_WEAKER) {
        const begins = yieldAt(strain, elastic);
        return (stresses) => ({ x0: begins(ownStress(side, stresses)), lost: 0 });
    }
    const left = GRID.map((place) => ((Math.exp(straight(place, x, peaks)) * place) / 0.7) ** FELT);
    const begins = yieldAt(strain, elastic, left);
    return (stresses) => {
        const x0 = begins(stresses.block);
        return { x0, lost: straight(DEEPER * x0, x, peaks) };
    };
}

/** What yielding does at x: the weaker body at each x tells of it, both where they are nearly alike. */
function lossOf(data, strain, elastic, stresses, x) {
    const blockWeaker = strain ? "strain block" : "stress block";
    const pinOfStrain = stresses.every(({ block }) => block === Infinity) ? PIN_ALONE : PIN_WEAKER;
    const pinWeaker = strain ? pinOfStrain : "stress pin";
    const shares = stresses.map(shareOfPin);
    const told = (side) => totalLoss(data, side, strain, elastic, stresses, x);
    const ofBlock = shares.some((share) => share < 1) ? told(blockWeaker) : null;
    const ofPin = shares.some((share) => share > 0) ? told(pinWeaker) : null;
    return shares.map((share, i) => {
        if (share === 0) return ofBlock[i];
        if (share === 1) return ofPin[i];
        const mixed = Object.keys(NO_LOSS).map((name) => [name, share * ofPin[i][name] + (1 - share) * ofBlock[i][name]]);
        return Object.fromEntries(mixed);
    });
}

// --- hardening

/** The yield stress at a PEEQ: straight between points, constant beyond the last. */
const flowStress = (points, peeq) => straight(peeq, points.map((point) => point[0]), points.map((point) => point[1]));

const BODIES = ["pin", "block"];
const LITTLE = 1e-6; // of a difference quotient
const WIDE = 3; // factor on a strain, up and down
const LARGEST_GAIN = 0.6; // ln(s_eff/s) beyond which eps_rep does not depend on it
const LEADS = 0.3; // part of the pin's s that the block's lacks, from which on the block leads
const SPREADS = 0.07; // rise of the block's curve with which e-fold less of it leads
const EARLIEST = 1.2; // x of first yield by s_eff over x, above which nothing has yielded
const ALIKE = 0.5; // |ln| of the bodies' s, beyond which it does not matter which is weaker
const SHARP = 0.12; // the same, within which the strain passes from one body to the other
const OF_STRONGER = 0.1; // of the rise of the pin's curve: ln of what it takes from the s of a stronger block
const NEARLY_ALIKE = 0.15; // the same, beyond which the curve of the weaker body alone tells of p0

/** The mean s by a strain, of strains about it. */
const meanFlow = (flow, { strains, shares }) => (strain) =>
    strains.reduce((sum, part, i) => sum + shares[i] * flow(strain * part), 0);

/** How the mean flow rises from a third of a strain to three times it, in logarithms: its s, slope, and bend. */
function curveAt(mean, strain) {
    const [below, s, above] = [strain / WIDE, strain, WIDE * strain].map(mean);
    return { s, rise: Math.log(above / below) / (2 * Math.log(WIDE)), bend: Math.log((above * below) / s ** 2) };
}

/** ln(eps_rep R/dR) of a body at x, where the bodies have these s: a sum of products of inputs. */
function lnStrain(model, coefficients, { p, m, n, clearance }, body, first, x, { s, rise, bend }, other, begins) {
    const ls = Math.log(s);
    const weaker = clip(Math.log(other) - ls, -ALIKE, ALIKE);
    const inputs = {
        1: 1,
        x: Math.log(Math.max(x, 0.05)),
        s: ls,
        share: (body === "pin" ? p : 1 - p) - 0.5,
        soft: body === "pin" ? p * m : (1 - p) * n,
        weaker,
        apart: Math.abs(weaker),
        sharp: Math.tanh(weaker / SHARP),
        clearance: Math.log(clearance / 0.005),
        rise,
        bend,
        gain: Math.min(ls - Math.log(first), LARGEST_GAIN),
        onset: Math.min(begins(s) / x, EARLIEST) ** 2,
    };
    const product = (names) => names.split(" ").reduce((all, name) => all * inputs[name], 1);
    return model.terms.reduce((sum, names, k) => sum + coefficients[k] * product(names), 0);
}

/** s_eff of both bodies at each x, with their representative strains, by Newton's method; `flows` are means. */
function representative(model, strain, elastic, begin, flows, x) {
    const plane = strain ? "strain" : "stress";
    const hardens = BODIES.map((body) => Boolean(flows[body]));
    const first = BODIES.map((body) => begin[body]);
    const begins = yieldAt(strain, elastic);
    return x.map((place) => {
        const ln = (i, curves) => {
            const coefficients = model.strain[`${plane} ${BODIES[i]}`];
            return lnStrain(model, coefficients, elastic, BODIES[i], first[i], place, curves[i], curves[1 - i].s, begins);
        };
        const straight = first.map((s) => ({ s, rise: 0, bend: 0 }));
        const curvesAt = (eps) => straight.map((own, i) => (hardens[i] ? curveAt(flows[BODIES[i]], eps[i]) : own));
        const missAt = (eps) => {
            const curves = curvesAt(eps);
            return hardens.map((own, i) => (own ? Math.log(eps[i] / elastic.clearance) - ln(i, curves) : 0));
        };
        let eps = hardens.map((own, i) => (own ? elastic.clearance * Math.exp(ln(i, straight)) : 0));
        let step = [0, 0];
        for (let k = 0; k < 40; k++) {
            const miss = missAt(eps);
            const slopesBy = (j) => {
                const shifted = missAt(eps.map((own, i) => (i === j ? own * (1 + LITTLE) : own)));
                return shifted.map((own, i) => (own - miss[i]) / Math.log1p(LITTLE));
            };
            step = newtonStep(slopesBy(0), slopesBy(1), hardens, miss, step);
            eps = eps.map((own, i) => own * Math.exp(-step[i]));
            if (Math.max(...step.map(Math.abs)) <= 1e-10) break;
        }
        if (Math.max(...step.map(Math.abs)) > 1e-4) {
            const said = "as the curves rise in steep steps; solve this joint instead";
            throw new RangeError(`archord: the law finds no representative strain at ${inDigits(place)} dR, ${said}.`);
        }
        const [pin, block] = curvesAt(eps).map((curve) => curve.s);
        return { pin, block, strain: { pin: eps[0], block: eps[1] } };
    });
}

/** Newton's step in ln(eps_rep) by slopes by each, at most half of the `last` one where it turns back. */
function newtonStep(byPin, byBlock, hardens, miss, last) {
    const [a, d] = [byPin[0], byBlock[1]].map((own, i) => (hardens[i] ? Math.max(own, 0.3) : 1));
    const [b, c] = [byBlock[0], byPin[1]];
    const full = [d * miss[0] - b * miss[1], a * miss[1] - c * miss[0]].map((own) => own / (a * d - b * c));
    return full.map((own, i) => {
        const farthest = own * last[i] < 0 ? Math.abs(last[i]) / 2 : 1;
        return clip(own, -farthest, farthest);
    });
}

/** Throw, with Python's sentence, for a body that has hardened to more than `most` times its yield stress. */
function requireGain(most, { pin, block }, begin, flows) {
    const gain = Math.max(flows.pin ? pin / begin.pin : 1, flows.block ? block / begin.block : 1);
    if (gain <= most) return;
    const said = `${inDigits(gain, 3)} times the yield stress, at most ${inDigits(most)} times is covered`;
    throw new RangeError(`archord: a body hardens by 3 dR to ${said}.`);
}

/** What yielding does at x to a joint whose bodies harden: as perfectly plastic ones with s_eff. */
function hardenedLoss(data, strain, elastic, begin, given, x) {
    const flows = {};
    for (const body of BODIES) flows[body] = given[body] && meanFlow(given[body], data.hardening);
    const found = representative(data.hardening, strain, elastic, begin, flows, x);
    requireGain(data.range.gain, found[found.length - 1], begin, flows);
    const rises = found.map(({ strain: own }) => BODIES.map((body) => (flows[body] ? curveAt(flows[body], own[body]).rise : 0)));
    const felt = found.map(({ pin, block }, i) => {
        const taken = strain ? OF_STRONGER * rises[i][0] * shareOfPin({ pin, block }) : 0;
        return { pin, block: block * Math.exp(-taken) };
    });
    const lost = lossOf(data, strain, elastic, felt, x);
    const logs = x.map(Math.log);
    const slopes = splineSlopes(logs, lost.map((state) => state.force), false);
    const alone = BODIES.filter((body) => Number.isFinite(begin[body]));
    const plane = strain ? "strain" : "stress";
    const kind = `${plane} ${alone.length > 1 ? "both" : alone[0]}`;
    return lost.map((state, i) => {
        const { pin, block } = found[i];
        const across = rises[i].map((rise) => 2 * Math.log(WIDE) * rise);
        const wrong = data.hardening.error[kind] * Math.hypot(0.5, ...across) * yielded(state.force, 0.02);
        const ofPin = smoothStep(0.5 + Math.log(block / pin) / (2 * NEARLY_ALIKE));
        const rise = ofPin * rises[i][0] + (1 - ofPin) * rises[i][1];
        const peak = state.peak + data.hardening.peak[plane] * rise * yielded(state.peak, 0.1);
        const deviation = Math.hypot(state.deviation, wrong);
        const wayError = Math.hypot(state.wayError, wrong);
        const leads = blockLeads(strain, pin, block, rises[i][1]);
        return { ...state, slope: slopes[i] / x[i], deviation, peak, wayError, leads };
    });
}

/** How far a block that is weaker than the pin leads in plane stress: less where its curve rises. */
function blockLeads(strain, pin, block, rise) {
    if (strain || block === Infinity) return 0;
    return clip((1 - block / pin) / LEADS, 0, 1) * Math.exp(-rise / SPREADS);
}

/** How far a loss of P or p0 has got to where all of what hardening does is felt. */
const yielded = (loss, felt) => clip((1 - Math.exp(loss)) / felt, 0, 1);

// --- the law of one joint

const NODES = [0, ...geomspace(0.02, 3, 60)]; // x = delta/dR
// Of P, relative: of small x, and else of what is elastic.
const EARLY_ERROR = 1e-3;
const SMALL_X = 0.1;
const ELASTIC_ERRORS = [1.6e-4, 3.2e-4];
const SOFT = [0.5, 0.6]; // p m of pins, between which the elastic error goes from one to the other
const STEEPEST = 0.999; // secant of the way back over the elastic joint's steepest slope: then it is a straight line

/** A number as Python's `g` prints it, in this many digits. */
export function inDigits(value, digits = 6) {
    if (value === Infinity) return "inf";
    if (Number.isNaN(value)) return "nan";
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    const power = Number(exponent);
    const short = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
    if (power >= -4 && power < digits) return short(value.toFixed(Math.max(digits - 1 - power, 0)));
    return `${short(mantissa)}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;
}

/** The faults of a joint, a sentence each, as Python's LawJoint raises them. */
export function faultsOf(joint) {
    const said = [];
    for (const name of ["radius", "clearance", "E_star", "pin_yield", "block_yield", "length"]) {
        const value = joint[name];
        if (value != null && !(Number.isFinite(value) && value > 0)) {
            said.push(`${name} = ${inDigits(value)} must be a positive number.`);
        }
    }
    for (const name of ["nu", "pin_nu"]) {
        const value = joint[name];
        if (value != null && !(value > -1 && value < 0.5)) {
            said.push(`${name} = ${inDigits(value)} must be between -1 and 0.5.`);
        }
    }
    return said;
}

/** The joint of two bodies, each {E, nu, yield, hardening}, or a rigid pin (null). */
export function jointOf({ radius, clearance, plane, length, friction, large_strain, pin, block }) {
    const modulus = ({ E, nu }) => (plane === "strain" ? E / (1 - nu ** 2) : E);
    const wall = modulus(block);
    const own = pin ? modulus(pin) : Infinity;
    return {
        radius,
        clearance,
        plane,
        length,
        friction,
        large_strain,
        E_star: pin ? 1 / (1 / own + 1 / wall) : wall,
        pin_share: pin ? 1 / (1 + own / wall) : 0,
        nu: block.nu,
        pin_nu: pin ? pin.nu : null,
        pin_yield: pin ? (pin.yield ?? null) : null,
        block_yield: block.yield ?? null,
        pin_hardening: pin ? (pin.hardening ?? null) : null,
        block_hardening: block.hardening ?? null,
    };
}

/** Plane (true: strain), p, m, n, dR/R, and s of pin and block, which decide a joint. */
function numbersOf(joint) {
    const strain = joint.plane === "strain";
    const [m, n] = [joint.pin_nu ?? joint.nu, joint.nu].map((nu) => (strain ? nu / (1 - nu) : nu));
    const unit = (joint.E_star * joint.clearance) / joint.radius;
    const [pin, block] = [joint.pin_yield, joint.block_yield].map((s) => (s == null ? Infinity : s / unit));
    const p = joint.pin_share;
    return { strain, p, m: p ? m : 0, n, clearance: joint.clearance / joint.radius, pin, block, unit };
}

/** The part of P by which small strain is too low at 2 dR, about, where a block thickens; else 0: thickening.py. */
export function missedBySmallStrain(joint) {
    const { plane, large_strain, clearance, radius, E_star, block_hardening } = joint;
    const pin = joint.pin_yield ?? Infinity;
    const block = joint.block_yield ?? Infinity;
    const ratio = clearance / radius;
    const thickens = plane === "stress" && block < 0.7 * pin && block <= 1.3 * E_star * ratio;
    if (large_strain || !thickens) return 0;
    return 2 * ratio * (block_hardening ? 1 : 0.4 / Math.sqrt(Math.max(ratio, 1e-3)));
}

/** What puts a joint outside the range of the law: parameter, value and range; empty inside. */
export function outside(data, joint) {
    const { nu: ofNu, clearances, ratios, smallest, friction } = data.range;
    const { strain, p, m, n, clearance, pin, block } = numbersOf(joint);
    const [pinNu, nu] = [m, n].map((value) => (strain ? value / (1 + value) : value));
    const softer = strain ? (1 - pinNu ** 2) / (1 - nu ** 2) : 1;
    const stiffness = p ? ((1 - p) / p) * softer : Infinity;
    const checks = [
        ["nu of the pin", pinNu, ...ofNu],
        ["nu of the block", nu, ...ofNu],
        ["dR/R", clearance, ...clearances],
        ["E(pin)/E(block)", stiffness, ratios[0], joint.pin_yield == null ? Infinity : ratios[1]],
        ["sigY R/(E* dR)", Math.min(pin, block), smallest[joint.plane], Infinity],
        ["friction", joint.friction ?? 0, 0, friction],
    ];
    for (const [name, value, low, high] of checks) {
        if (!(low * (1 - 1e-3) <= value && value <= high * (1 + 1e-3))) {
            const to = high < Infinity ? `to ${inDigits(high)}` : "and more";
            return `${name} = ${inDigits(value, 4)} is outside ${inDigits(low)} ${to}`;
        }
    }
    return "";
}

/** The law of a joint in its units. Throws, with Python's sentence, for a joint that is none or is outside. */
export function generalLaw(data, joint) {
    const [fault] = faultsOf(joint);
    const reason = fault ? "" : outside(data, joint);
    if (fault) throw new RangeError(fault);
    if (reason) throw new RangeError(`archord: ${reason}.`);
    const numbers = numbersOf(joint);
    const elastic = elasticJoint(data.elastic, numbers);
    const begins = yieldAt(numbers.strain, elastic);
    const x = NODES.slice(1);
    const limited = (s) => (ELASTIC_BELOW * begins(s) >= NODES[NODES.length - 1] ? Infinity : s);
    const stresses = { pin: limited(numbers.pin), block: limited(numbers.block) };
    const flows = {};
    for (const body of BODIES) {
        const points = joint[`${body}_hardening`];
        const yields = stresses[body] < Infinity;
        flows[body] = points && yields ? (peeq) => flowStress(points, peeq) / numbers.unit : null;
    }
    let lost = null;
    if (flows.pin || flows.block) lost = hardenedLoss(data, numbers.strain, elastic, stresses, flows, x);
    else if (Math.min(stresses.pin, stresses.block) < Infinity) {
        const leads = blockLeads(numbers.strain, stresses.pin, stresses.block, 0);
        const states = lossOf(data, numbers.strain, elastic, x.map(() => stresses), x);
        lost = states.map((state) => ({ ...state, leads }));
    }
    const [added, ofElastic] = [lost, null].map((own) => addedBy(data, joint, { elastic, lost: own }, x));
    const tables = reduced(elastic, lost, added, ofElastic);
    const force = joint.E_star * joint.clearance;
    const firstYield = joint.clearance * Math.min(begins(numbers.pin), begins(numbers.block));
    return new JointLaw({ ...tables, length: joint.clearance, force, pressure: numbers.unit, firstYield });
}

/** The tables of a joint in units of dR, E* dR and E* dR/R, with what is lost to yielding (null: elastic) and what
 * friction and large strain have added, and add to elastic bodies, whose curve ways back follow (null: neither). */
function reduced(elastic, lost, added, ofElastic) {
    const x = NODES.slice(1);
    const base = x.map(elastic.at);
    let back = base.map((state) => state.y);
    let steep = base.map((state) => state.slope);
    if (ofElastic) [back, steep] = raised(x, back, steep, ofElastic);
    let y = back;
    let dy = steep;
    let peak = base.map((state) => state.peak);
    let angle = base.map((state) => state.angle);
    const soft = clip((elastic.p * elastic.m - SOFT[0]) / (SOFT[1] - SOFT[0]), 0, 1);
    const usual = ELASTIC_ERRORS[0] + soft * (ELASTIC_ERRORS[1] - ELASTIC_ERRORS[0]);
    let error = x.map((place) => (place < SMALL_X ? EARLY_ERROR : usual));
    let ratio = x.map(() => 1);
    let toe = x.map(() => 0);
    let backError = x.map(() => 0);
    if (lost) {
        y = base.map((state, i) => state.y * Math.exp(lost[i].force));
        dy = base.map((state, i) => (state.slope / state.y + lost[i].slope) * y[i]);
        [y, dy] = rising(x, y, dy);
        peak = peak.map((own, i) => own * Math.exp(lost[i].peak));
        angle = angle.map((own, i) => own * Math.exp(lost[i].angle));
        error = error.map((own, i) => Math.hypot(own, lost[i].deviation));
        const unit = x.map((place, i) => (place * y[i]) / base[i].y);
        const travels = x.map((place, i) => clip(lost[i].travel * unit[i], 1e-3 * place, place));
        const opens = accumulate(x.map((place, i) => place - travels[i]), maximum);
        const travel = x.map((place, i) => place - opens[i]);
        toe = x.map((place, i) => clip(lost[i].toe * unit[i], 0, place - travel[i]));
        backError = error.map((own, i) => Math.hypot(own, lost[i].wayError));
        if (added) [y, dy] = raised(x, y, dy, added);
        ratio = ratios(x, back, steep, y, travel);
    }
    if (added) {
        peak = peak.map((own, i) => own * Math.exp(added[i].peak));
        angle = angle.map((own, i) => own * Math.exp(added[i].angle));
        error = error.map((own, i) => Math.hypot(own, added[i].deviation));
        backError = backError.map((own, i) => Math.hypot(own, added[i].wayError));
    }
    const roots = y.map(Math.sqrt);
    const peaks = peak.map((own, i) => own / roots[i]);
    const angles = angle.map((own, i) => Math.min(own, Math.PI / 2) / roots[i]);
    const first = { peak: peak[0] / roots[0], angle: angles[0] };
    const tables = {
        x: NODES,
        y: [0, ...y],
        dy: [0, ...dy],
        back: [0, ...back],
        dback: [0, ...steep],
        ratio: [1, ...ratio],
        toe: [0, ...toe],
        touch: touchOf(elastic, x[0], back[0], steep[0]),
        peak: [first.peak, ...peaks],
        angle: [first.angle, ...angles],
        error: [error[0], ...error],
        back_error: [0, ...backError],
        yields: Boolean(lost || added),
    };
    for (const name of ["ratio", "peak", "angle"]) tables[`d${name}`] = pchipSlopes(NODES, tables[name]);
    return tables;
}

/** y and dy with what friction and large strain have added. */
function raised(x, y, dy, added) {
    const rises = splineSlopes(x.map(Math.log), added.map(({ force }) => force), false);
    const all = y.map((own, i) => own * Math.exp(added[i].force));
    return rising(x, all, dy.map((slope, i) => (slope / y[i] + rises[i] / x[i]) * all[i]));
}

/** a, b, c of the logarithmic law up to the first node x, where it is y with the slope dy. */
function touchOf(elastic, x, y, dy) {
    const first = elastic.touch(0);
    const rise = (Math.PI * x) / y - Math.log1p(1 / y) - first;
    const end = Math.PI / y + (dy / y) * (1 / (1 + y) - (Math.PI * x) / y);
    return [first, (2 * rise) / x - end, end / x - rise / x ** 2];
}

/** y and dy with as little changed as makes the cubics rise (Fritsch and Carlson 1980). */
function rising(x, y, dy) {
    const rises = accumulate(y, maximum);
    const secants = x.slice(1).map((end, i) => (rises[i + 1] - rises[i]) / (end - x[i]));
    const slopes = dy.map((slope, i) => {
        const least = Math.min(secants[Math.max(i - 1, 0)], secants[Math.min(i, secants.length - 1)]);
        return clip(slope, 0, 3 * least);
    });
    return [rises, slopes];
}

/** The ratio r of ways back: with a = travel/r the elastic joint's back(a)/a is y/travel. */
function ratios(x, back, steep, y, travel) {
    const end = x.length - 1;
    const secants = x.map((place, i) => back[i] / place);
    const off = steep[end] * x[end] - back[end];
    return y.map((largest, i) => {
        const secant = largest / travel[i];
        const far = off / (steep[end] - Math.min(secant, STEEPEST * steep[end]));
        return travel[i] / (secant > back[end] / x[end] ? far : straight(secant, secants, x));
    });
}

/** The law of one joint: tables over nodes x = delta/dR, and the units of x, y and p0. */
export class JointLaw {
    constructor(tables) {
        Object.assign(this, tables);
        this.end = this.x[this.x.length - 1];
        this.limit = this.length * this.end;
        const largest = Math.max(...this.angle.map((angle, i) => angle * Math.sqrt(this.y[i])));
        this.widest = largest > (1 + 1e-9) * (Math.PI / 2) ? largest : Math.PI / 2;
    }

    /** Load, stiffness, expected error, p0 and eps at delta, after the joint has been as deep as `deepest`. */
    at(delta, deepest = 0) {
        const x = delta / this.length;
        const most = Math.max(deepest / this.length, 0);
        if (x <= 0) return { load: 0, stiffness: 0, error: 0, peak: 0, angle: 0 };
        const state = this.yields && x < most ? this.wayBack(x, most) : this.firstLoading(x);
        return {
            load: state.y * this.force,
            stiffness: (state.dy * this.force) / this.length,
            error: state.error * this.force,
            peak: state.peak * this.pressure,
            angle: state.angle,
        };
    }

    /** The displacement of first loading at which the force is `load`. */
    displacement(load) {
        const y = load / this.force;
        const last = this.y[this.y.length - 1];
        return y <= (1 + 1e-9) * last ? this.length * this.inverse(this.y, this.dy, Math.min(y, last)) : NaN;
    }

    /** The displacement at which the joint opens on its way back from `deepest`. */
    residual(deepest) {
        const most = Math.max(deepest / this.length, 0);
        const toe = straight(most, this.x, this.toe);
        return this.length * Math.max(most - this.travel(most, this.ratioAt(most)) - toe, 0);
    }

    firstLoading(x) {
        const [y, dy] = this.curve(this.y, this.dy, x);
        const root = Math.sqrt(y);
        const [peak] = hermite(this.x, this.peak, this.dpeak, x);
        const [angle] = hermite(this.x, this.angle, this.dangle, x);
        const error = y * straight(x, this.x, this.error);
        return { y, dy, error, peak: peak * root, angle: Math.min(angle * root, this.widest) };
    }

    wayBack(x, most) {
        const ratio = this.ratioAt(most);
        const travel = this.travel(most, ratio);
        const [a, bend] = bent(x - most + travel, travel, straight(most, this.x, this.toe));
        const [base, rise] = this.curve(this.back, this.dback, Math.max(a / ratio, 0));
        const [largest] = this.curve(this.y, this.dy, most);
        const first = this.firstLoading(x);
        const above = ratio * base > first.y;
        return {
            y: above ? first.y : ratio * base,
            dy: above ? first.dy : a > 0 ? bend * rise : 0,
            error: largest * straight(most, this.x, this.back_error),
            peak: NaN,
            angle: NaN,
        };
    }

    ratioAt(most) {
        return Math.max(hermite(this.x, this.ratio, this.dratio, most)[0], 1e-3);
    }

    /** The travel of the way back from `most`, which meets first loading there. */
    travel(most, ratio) {
        const [largest] = this.curve(this.y, this.dy, most);
        return ratio * this.inverse(this.back, this.dback, largest / ratio);
    }

    curve(f, df, x) {
        if (x <= 0) return [0, 0];
        if (x >= this.x[1]) return hermite(this.x, f, df, x);
        return firstTouch(this.touch, Math.max(x, 1e-290));
    }

    /** The x at which the rising curve f is y: Newton's method, bracketed. */
    inverse(f, df, y) {
        if (!(y > 0)) return 0;
        const last = f.length - 1;
        if (y > f[last]) return this.end + (y - f[last]) / Math.max(df[last], 1e-100);
        if (y < f[1]) return this.touchDisplacement(y);
        const i = interval(f, y);
        const piece = pieceOf(this.x, f, df, i);
        let [low, high] = [0, 1];
        let t = (y - f[i]) / (f[i + 1] > f[i] ? f[i + 1] - f[i] : 1);
        for (let k = 0; k < 60; k++) {
            const [value, slope] = cubicAt(piece, t);
            if (value < y) low = t;
            else high = t;
            const before = t;
            t -= (value - y) / Math.max(slope, 1e-100);
            if ((t - low) * (high - t) < 0) t = (low + high) / 2;
            if (!(Math.abs(t - before) >= 1e-12)) break;
        }
        return this.x[i] + piece.width * t;
    }

    touchDisplacement(y) {
        const [a, b, c] = this.touch;
        const log = Math.log1p(1 / y);
        let x = (y * (a + log)) / Math.PI;
        for (let k = 0; k < ITERATIONS; k++) {
            const miss = (Math.PI * x) / y - a - x * (b + c * x) - log;
            x -= miss / (Math.PI / y - b - 2 * c * x);
        }
        return x;
    }
}

/** y and dy/dx of the logarithmic law at x > 0. */
export function firstTouch([a, b, c], x) {
    return lineContact(x, a + x * (b + c * x), b + 2 * c * x);
}

/** h(a) = t f(a)/f(t) of travel t and toe w, and its slope. */
function bent(a, travel, toe) {
    const cut = (Math.SQRT2 - 1) * toe;
    const root = Math.max(Math.hypot(a, toe), 1e-300);
    const share = travel / Math.max(travel + Math.hypot(travel, toe) - cut, 1e-300);
    return [share * (a + root - cut), share * (1 + a / root)];
}

// --- data

/** The bytes of base64 text that holds a deflated stream. */
export async function inflated(text) {
    const bytes = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The data of the law: `words`, the JSON of page.py, and `bytes`, its arrays in planes of bytes. */
export function lawData(words, bytes) {
    const arrays = {};
    let offset = 0;
    for (const [name, type, count] of words.arrays) {
        const size = type === "int16" ? 2 : 4;
        const whole = new Uint8Array(count * size);
        for (let k = 0; k < size; k++) {
            for (let i = 0; i < count; i++) whole[i * size + k] = bytes[offset + k * count + i];
        }
        offset += count * size;
        arrays[name] = new (type === "int16" ? Int16Array : Float32Array)(whole.buffer);
    }
    return { ...words, ...solvedJoints(words, arrays), processes: {} };
}

/** The solved joints that yield, and the rows of their ways back. */
function solvedJoints({ sides, step }, arrays) {
    const joints = [];
    let next = 0;
    for (let row = 0; row < arrays.side.length; row++) {
        const [, p, m, n, clearance, pin, block] = arrays.numbers.subarray(7 * row, 7 * row + 7);
        const known = arrays.count[row];
        const curves = {};
        for (const name of ["force", "peak", "angle"]) {
            let sum = 0;
            curves[name] = Array.from(arrays[name].subarray(next, next + known), (rise) => (sum += rise) * step);
        }
        next += known;
        const side = sides[arrays.side[row]];
        joints.push({ side, p, m, n, clearance, pin, block, x0: arrays.x0[row], lost: arrays.lost[row], known, ...curves });
    }
    const count = arrays.back.length / 6;
    const rowOf = (i) => Array.from({ length: 6 }, (_, column) => arrays.back[column * count + i]);
    return { joints, back: Array.from({ length: count }, (_, i) => rowOf(i)) };
}
