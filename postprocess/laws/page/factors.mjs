// What friction and large strain do to a joint on first loading: factor_model.py in JavaScript.

const USUAL_CLEARANCE = 0.005; // over R

/** What friction and large strain add at `x`, by nodes: ln of the factors on P, p0 and eps, and expected errors; null
 * without either. `plain` is the joint without them: elastic, and what is lost to yielding (null: nothing). */
export function addedBy(data, joint, { elastic, lost }, x) {
    const kinds = [];
    if (joint.friction) kinds.push("friction");
    if (joint.large_strain) kinds.push("large strain");
    if (!kinds.length) return null;
    return x.map((place, i) => {
        const angle = elastic.at(place).angle * Math.exp(lost ? lost[i].angle : 0);
        const scales = {
            friction: joint.friction * angle * Math.max(1 - x[0] / place, 0),
            "large strain": (place * joint.clearance) / joint.radius,
        };
        const { p, m, n } = elastic;
        const mu = (joint.friction ?? 0) / data.range.friction;
        const inputs = [mu, angle, p, p * m, (1 - p) * n, lost ? lost[i].force : 0];
        const products = data.factors.products.map((chosen) => chosen.reduce((all, k) => all * inputs[k], 1));
        const leading = lost ? lost[i].leads * lost[i].force : 0;
        const squared = leading * (lost ? lost[i].force : 0);
        const byClearance = Math.log(elastic.clearance / USUAL_CLEARANCE);
        const terms = [...products, leading, squared, leading * byClearance, squared * byClearance];
        return kinds
            .map((kind) => gainOf(data.factors.models[kind], joint.plane, scales[kind], terms, leading))
            .reduce(together);
    });
}

function gainOf(model, plane, scale, terms, leading) {
    const [force, peak, angle] = model.gain[plane].map(
        (row) => scale * row.reduce((sum, coefficient, k) => sum + coefficient * terms[k], 0),
    );
    const [usual, more] = model.error[plane];
    const deviation = scale * Math.hypot(usual, more * leading);
    return { force, peak, angle, deviation, wayError: scale * model["back error"][plane] };
}

function together(one, other) {
    return {
        force: one.force + other.force,
        peak: one.peak + other.peak,
        angle: one.angle + other.angle,
        deviation: Math.hypot(one.deviation, other.deviation),
        wayError: Math.hypot(one.wayError, other.wayError),
    };
}
