#ifndef LINK_TEXELS
#define LINK_TEXELS
// What the making of links looks at, in texels: nodes as senders and as receivers.
//
// Of a sender:
//   0: centre (m) | radius (m)
//   1: normal | thickness (m)
//   2, 3: half axes of its ellipse, conjugate to each other (m) | of a leaf: first corner; 4 * corner count + sides
//         of a node about a plane: of the ellipse through the corners of the parallelogram that it is seen by
//         of a node without a plane: covariance of its points, xx, yy, zz (m2); xy, yz, zx (m2)
//   4: of a leaf: its vertex (m); of a flat one: the vertex in units of the half axes, from the centre
//      of a node about a plane: from its centre to the parallelogram's middle (m)
//      of a node without a plane: mean of its normals by area
const uint SENDER_TEXELS = 5;
// Of a receiver:
//   0: where it receives (m) | how far it reaches above its own horizon (m)
//   1: normal | cosine of its cone
//   2: quaternion that turns directions of its bins into world space
const uint RECEIVER_TEXELS = 3;

// Half a side of a parallelogram, in half axes of the ellipse through its corners.
const float IN_CORNERS = 0.70710678;

const float FLAT = 1e-3;        // a leaf as thin as this, against its radius, is a plane
const float BENT_AWAY = 0.5;    // cosine of the cone from which on a node has no plane

bool is_flat(float thickness, float radius) { return thickness <= FLAT * radius; }
bool has_plane(float cos_cone) { return cos_cone >= BENT_AWAY; }
#endif
