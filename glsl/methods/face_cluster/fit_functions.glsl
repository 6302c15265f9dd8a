#ifndef FACE_CLUSTER_FIT_FUNCTIONS
#define FACE_CLUSTER_FIT_FUNCTIONS
// What nodes of an element say of all of it: how what arrives at the receiver's makes its functions, and how much each
// of the shooter's weighs. Included after lay_nodes.

// Added to the squares of functions that are not even, so that nodes that stand in a row, or at one place, say no more
// than they can.
const float RIDGE = 1e-3;
// Of those that are not linear, on flat faces that do not fill their square: for means, and for what else is known of a
// receiver, some of whose nodes may be in shadow.
const float MEAN_RIDGE = 1e-2, SHAPE_RIDGE = 0.1;
// Faces that are looked at, at most, for what functions are over all.
const uint MOST_FACES = 64;
const uint SQUARE = MOST_FUNCTIONS * MOST_FUNCTIONS;

// Means of products of two functions over an element; and over its nodes, of which it becomes Cholesky's factor.
float products[SQUARE], at_nodes[SQUARE];

// By how much each node makes the mean.
float mean_weights[RULE_NODES];

// Where a node counts as standing: a flat element's where it is, others where the rule has them.
vec2 node_coordinates(uint index, FaceElement e, uint k)
{
    return is_flat(e) ? plane_coordinates(e, element_nodes[index * RULE_NODES + k]) : rules[k].uv;
}

// `products` over the faces of a flat element, or over so many of them, each for those next to it.
void multiply_over_faces(FaceElement e, ClusterInstance inst, uint rows, uint columns)
{
    uint taken = min(e.place_count, MOST_FACES);
    float all = 0.0;
    [[dont_unroll]] for (uint i = 0; i < SQUARE; ++i) products[i] = 0.0;
    [[dont_unroll]] for (uint f = 0; f < taken; ++f) {
        vec3 corners[3];
        corners_of(inst, e.first_place - inst.first_triangle + (2 * f + 1) * e.place_count / (2 * taken), corners);
        vec3 ab = corners[1] - corners[0], ac = corners[2] - corners[0];
        float area = length(cross(ab, ac));
        all += area;
        [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
            CubatureNode node = rules[RULE_NODES + r];
            vec2 uv = plane_coordinates(e, corners[0] + node.uv.x * ab + node.uv.y * ac);
            [[dont_unroll]] for (uint k = 0; k < columns; ++k) {
                float value = area * node.weight * basis(k, uv);
                [[dont_unroll]] for (uint j = 0; j < rows; ++j)
                    products[j * MOST_FUNCTIONS + k] += value * basis(j, uv);
            }
        }
    }
    [[dont_unroll]] for (uint i = 0; i < SQUARE; ++i) products[i] /= max(all, 1e-30);
}

// Cholesky's factor of the first n rows, in place.
void factorise(inout float a[SQUARE], uint n)
{
    const uint S = MOST_FUNCTIONS;
    [[dont_unroll]] for (uint j = 0; j < n; ++j)
        [[dont_unroll]] for (uint i = j; i < n; ++i) {
            float sum = a[i * S + j];
            [[dont_unroll]] for (uint k = 0; k < j; ++k) sum -= a[i * S + k] * a[j * S + k];
            a[i * S + j] = i == j ? sqrt(max(sum, 1e-6)) : sum / a[j * S + j];
        }
}

void solve(float factor[SQUARE], uint n, inout float column[MOST_FUNCTIONS])
{
    const uint S = MOST_FUNCTIONS;
    [[dont_unroll]] for (uint i = 0; i < n; ++i) {
        [[dont_unroll]] for (uint k = 0; k < i; ++k) column[i] -= factor[i * S + k] * column[k];
        column[i] /= factor[i * S + i];
    }
    [[dont_unroll]] for (uint down = 0; down < n; ++down) {
        uint i = n - 1 - down;
        [[dont_unroll]] for (uint k = i + 1; k < n; ++k) column[i] -= factor[k * S + i] * column[k];
        column[i] /= factor[i * S + i];
    }
}

// `at_nodes` of `count` nodes from `first` on.
void multiply_over_nodes(uint index, FaceElement e, uint first, uint count, uint rows)
{
    uint rule = e.place_count == 1 ? RULE_NODES : 0;
    [[dont_unroll]] for (uint i = 0; i < SQUARE; ++i) at_nodes[i] = 0.0;
    [[dont_unroll]] for (uint r = first; r < first + count; ++r) {
        vec2 uv = node_coordinates(index, e, r);
        [[dont_unroll]] for (uint j = 0; j < rows; ++j)
            [[dont_unroll]] for (uint k = 0; k < rows; ++k)
                at_nodes[j * MOST_FUNCTIONS + k] += rules[rule + r].weight * basis(j, uv) * basis(k, uv);
    }
}

void lay_through(uint rows, float higher)
{
    [[dont_unroll]] for (uint i = 1; i < rows; ++i) at_nodes[i * MOST_FUNCTIONS + i] += i < 3 ? RIDGE : higher;
    factorise(at_nodes, rows);
}

// `mean_weights` of `count` nodes from `first` on: of what is laid through them. Others have those of the rule.
void weigh(uint index, FaceElement e, uint first, uint count, uint rows, bool by_faces)
{
    uint rule = e.place_count == 1 ? RULE_NODES : 0;
    if (by_faces) {
        multiply_over_nodes(index, e, first, count, rows);
        lay_through(rows, MEAN_RIDGE);
    }
    float column[MOST_FUNCTIONS];
    [[dont_unroll]] for (uint r = first; r < first + count; ++r) {
        mean_weights[r] = rules[rule + r].weight;
        if (!by_faces) continue;
        vec2 uv = node_coordinates(index, e, r);
        [[dont_unroll]] for (uint k = 0; k < rows; ++k) column[k] = rules[rule + r].weight * basis(k, uv);
        solve(at_nodes, rows, column);
        mean_weights[r] = 0.0;
        [[dont_unroll]] for (uint k = 0; k < rows; ++k) mean_weights[r] += products[k] * column[k];
    }
}

// By how much what arrives at each receiver node makes each function: functions are laid through it by least squares,
// and projected on those of irradiance over the faces, with the mean that the nodes tell; the mean of each function over
// the element; and by how much each shooter node makes the mean of what it sends.              [Gobbetti2003 Eq. 7]
// Differs from [Gobbetti2003]: there all surfaces fill their squares, where this is the projection on orthonormal
// functions and the rule's weights. Where faces do not, their nodes lie on borders, and would count those for too much.
void fit_functions(uint index, FaceElement e, ClusterInstance inst, bool is_whole)
{
    const uint N = IRRADIANCE_FUNCTIONS, S = MOST_FUNCTIONS, FITS = N * RECEIVER_NODES + SHOOTER_NODES;
    uint rule = e.place_count == 1 ? RULE_NODES : 0;
    bool fills = !is_flat(e) || e.area > 0.99 * 4.0 * e.half_extent.x * e.half_extent.y;
    bool by_faces = !fills && is_whole && e.place_count > 1;
    float squares[SQUARE], column[S], own[S];

    if (by_faces) multiply_over_faces(e, inst, N, max(LAID_FUNCTIONS, SENT_FUNCTIONS));
    weigh(index, e, 0, RECEIVER_NODES, LAID_FUNCTIONS, by_faces);
    weigh(index, e, RECEIVER_NODES, SHOOTER_NODES, SENT_FUNCTIONS, by_faces);
    multiply_over_nodes(index, e, 0, RECEIVER_NODES, LAID_FUNCTIONS);
    if (!by_faces) products = at_nodes;
    lay_through(LAID_FUNCTIONS, fills ? RIDGE : SHAPE_RIDGE);
    squares = products;
    [[dont_unroll]] for (uint j = 1; j < N; ++j) squares[j * S + j] += 1e-5;
    factorise(squares, N);
    [[dont_unroll]] for (uint r = 0; r < RECEIVER_NODES; ++r) {
        vec2 uv = node_coordinates(index, e, r);
        [[dont_unroll]] for (uint k = 0; k < LAID_FUNCTIONS; ++k) column[k] = rules[rule + r].weight * basis(k, uv);
        solve(at_nodes, LAID_FUNCTIONS, column);
        [[dont_unroll]] for (uint j = 0; j < N; ++j) {
            own[j] = 0.0;
            [[dont_unroll]] for (uint k = 0; k < LAID_FUNCTIONS; ++k) own[j] += products[j * S + k] * column[k];
        }
        solve(squares, N, own);
        float said = 0.0;
        [[dont_unroll]] for (uint j = 0; j < N; ++j) said += products[j] * own[j];
        own[0] += mean_weights[r] - said;
        [[dont_unroll]] for (uint j = 0; j < N; ++j) fits[index * FITS + j * RECEIVER_NODES + r] = own[j];
    }
    [[dont_unroll]] for (uint j = 0; j < N; ++j) function_means[index * N + j] = products[j];
    [[dont_unroll]] for (uint s = 0; s < SHOOTER_NODES; ++s)
        fits[index * FITS + N * RECEIVER_NODES + s] = mean_weights[RECEIVER_NODES + s];
}
#endif
