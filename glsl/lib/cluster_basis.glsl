#ifndef LIB_CLUSTER_BASIS
#define LIB_CLUSTER_BASIS
// The orthonormal functions on [0,1]^2 that Gram-Schmidt makes of 1, u, v, uv, u^2, v^2, u^3, u^2 v, u v^2, v^3:
// products of Legendre polynomials. The first 1, 3, 4, 6 or 10 are a basis.                    [Gobbetti2003 4]
const uint MOST_FUNCTIONS = 10u;

float basis(uint k, vec2 uv)
{
    vec2 s = 2.0 * uv - 1.0;
    vec2 p1 = 1.7320508075688772 * s;
    vec2 p2 = 1.118033988749895 * (3.0 * s * s - 1.0);
    vec2 p3 = 1.3228756555322954 * s * (5.0 * s * s - 3.0);
    switch (k) {
    case 0: return 1.0;
    case 1: return p1.x;
    case 2: return p1.y;
    case 3: return p1.x * p1.y;
    case 4: return p2.x;
    case 5: return p2.y;
    case 6: return p3.x;
    case 7: return p2.x * p1.y;
    case 8: return p1.x * p2.y;
    default: return p3.y;
    }
}

// Gauss-Legendre with 4 points a side: exact for products of two cubics.
const float GAUSS_PLACES[4] = float[4](0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263);
const float GAUSS_WEIGHTS[4] = float[4](0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693);

vec2 gauss_point(uint k) { return vec2(GAUSS_PLACES[k & 3u], GAUSS_PLACES[k >> 2]); }
float gauss_weight(uint k) { return GAUSS_WEIGHTS[k & 3u] * GAUSS_WEIGHTS[k >> 2]; }

// A place of the square with its share of it.
struct CubatureNode {
    vec2 uv;
    float weight;
};
#endif
