/* The root t, about 1/2 at most, of sum gaps[i] r^i = 0, r = t / (1 - t): Newton steps in t, where the curve is nearly
 * straight, kept inside a bracket by bisection in the logarithm of r. share: first guess of 2t. Rounds are bounded. */
static float near_share(const float *gaps, const float *totals, float share)
{
    float low = 0.0f;
    float high = 2.0f;
    float shrink = 0.25f;
    float last_step = 8.0f;
    float r = share / (2.0f - share);
    int rounds;
    for (rounds = 0; rounds < ROUNDS_MAX; ++rounds) {
        float gap = gaps[ORDER];
        float total = totals[ORDER];
        float gap_slope = 0.0f;
        float total_slope = 0.0f;
        float next = -1.0f;
        float rise;
        int i;
        for (i = ORDER - 1; i >= 0; --i) {
            gap_slope = gap_slope * r + gap;
            gap = gap * r + gaps[i];
            total_slope = total_slope * r + total;
            total = total * r + totals[i];
        }
        if (gap < 0.0f) {
            low = r;
        } else if (gap > 0.0f) {
            high = r;
        } else {
            break;
        }
        rise = gap_slope * total - gap * total_slope;
        if (rise > 0.0f) {
            const float step = -gap * total / rise;
            if (step < 1.0f + r) {
                next = (r * (1.0f + r) + step) / (1.0f + r - step);
            }
        }
        if (magnitude(next - r) <= $close_f * r) {
            r = next;
            break;
        }
        if (!(low < next && next < high) || magnitude(next - r) > 0.5f * last_step) {
            if (low > 0.0f) {
                next = sqrtf(low) * sqrtf(high);
            } else {
                next = high * shrink;
                shrink = shrink * shrink;
            }
        }
        last_step = magnitude(next - r);
        r = next;
    }
    return r / (1.0f + r);
}

/* Seen from the end that is nearer in t. */
static float inside(const branch *curve, float force_n, float up, float down)
{
    float gaps[ORDER + 1];
    float mirrored[ORDER + 1];
    int i;
    if (force_n <= curve->half_n) {
        for (i = 0; i <= ORDER; ++i) {
            gaps[i] = curve->totals[i] * (curve->handles_n[i] - force_n);
        }
        return X0_V + X_SPAN_V * near_share(gaps, curve->totals, up / (curve->half_n - curve->handles_n[0]));
    }
    for (i = 0; i <= ORDER; ++i) {
        gaps[i] = curve->totals[ORDER - i] * (force_n - curve->handles_n[ORDER - i]);
        mirrored[i] = curve->totals[ORDER - i];
    }
    return X1_V - X_SPAN_V * near_share(gaps, mirrored, down / (curve->handles_n[ORDER] - curve->half_n));
}
