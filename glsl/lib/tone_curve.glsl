#ifndef LIB_TONE_CURVE
#define LIB_TONE_CURVE
// What a display shows of a scaled luminance, 0..1 and encoded as sRGB: report::tonemap in one number.

const uint TONE_REINHARD = 0u;
const uint TONE_FILMIC = 1u;

float srgb_encoded(float x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055; }

// Before normalisation.                                                                               [Hable2010]
float hable(float x) { return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3; }

float display_value(float luminance, uint operator, float white)
{
    float x = clamp(luminance, 0.0, 1e9);
    if (operator == TONE_REINHARD) x = x * (1.0 + x / (white * white)) / (1.0 + x);
    else if (operator == TONE_FILMIC) x = hable(2.0 * x) / hable(11.2);
    return srgb_encoded(clamp(x, 0.0, 1.0));
}

float srgb_decoded(float x) { return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4); }

// The scaled luminance that is shown as `value`, 0..1: the inverse of display_value up to white.
float luminance_shown_as(float value, uint operator, float white)
{
    float y = srgb_decoded(value);
    if (operator == TONE_REINHARD) return 2.0 * y / (1.0 - y + sqrt((1.0 - y) * (1.0 - y) + 4.0 * y / (white * white)));
    if (operator == TONE_FILMIC) {
        float q = y * hable(11.2) + 0.02 / 0.3;
        float a = 0.15 * (1.0 - q), b = 0.05 - 0.5 * q, c = 0.004 - 0.06 * q;
        return (sqrt(max(b * b - 4.0 * a * c, 0.0)) - b) / (4.0 * a);
    }
    return y;
}
#endif
