/* Order 2 in closed form, written so that nothing cancels: t : 1 - t as up : m + root, or root - m : down. */
static float inside(const branch *curve, float force_n, float up, float down)
{
    const float m = curve->weights[1] * (curve->handles_n[1] - force_n);
    float root;
    up = curve->weights[0] * up;
    down = curve->weights[2] * down;
    root = sqrtf(m * m + up * down);
    if (m >= 0.0f) {
        down = m + root;
    } else {
        up = root - m;
    }
    if (up <= down) {
        return X0_V + X_SPAN_V * (up / (up + down));
    }
    return X1_V - X_SPAN_V * (down / (up + down));
}
