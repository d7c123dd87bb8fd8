/* Order 1 in closed form: t : 1 - t as up : down. */
static float inside(const branch *curve, float force_n, float up, float down)
{
    (void)force_n;
    up = curve->weights[0] * up;
    down = curve->weights[1] * down;
    if (up <= down) {
        return X0_V + X_SPAN_V * (up / (up + down));
    }
    return X1_V - X_SPAN_V * (down / (up + down));
}
