/* The same without memory: blend is where between the branches the plant is, 1 rising .. -1 falling. ${p}_share is
 * the blend of a state. */
${p}_status ${p}_voltage(float force_n, float blend, float *voltage_v);
${p}_status ${p}_force(float voltage_v, float blend, float *force_n);
float ${p}_share(const ${p}_state *state);
