#version 460
#include "lib/prelude.glsl"
#include "lib/specular_albedo.glsl"
#include "methods/implicit_visibility/gloss.glsl"

// One thread per (glossy leaf of a window, direction): radiance that its specular lobe sends there, of what arrives by its
// bins. The lobe's albedo times the mean of what arrives within it: few bins neither make nor lose light.  [Dong2007 4.3]
// reads glossy_leaves, winners[6 n n * leaf_count of the window], receivers, bin_vectors[6 n n] (sr), bin_radiance,
// node_radiosity (W/m2), glossy_of_node [node_count], specular (of all glossy nodes), lobes[vertex_count],
// leaf_elements, element_vertices   writes reflected[glossy leaf * directions] (W m^-2 sr^-1)   shared none
// Differs from [Dong2007]: glossy light between elements, which the paper leaves out on the GPU.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer GlossyLeaves { uint glossy_leaves[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Winners { uint winners[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Receivers { Receiver receivers[]; };
layout(set = 0, binding = 3, scalar) readonly buffer BinVectors { vec3 bin_vectors[]; };
layout(set = 0, binding = 4, scalar) readonly buffer BinRadiance { vec3 bin_radiance[]; };
layout(set = 0, binding = 5, scalar) readonly buffer NodeRadiosity { vec3 node_radiosity[]; };
layout(set = 0, binding = 6, scalar) readonly buffer GlossyOfNode { uint glossy_of_node[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Specular { vec3 specular[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Lobes { LeafGloss lobes[]; };
layout(set = 0, binding = 9, scalar) readonly buffer LeafElements { uint leaf_elements[]; };
layout(set = 0, binding = 10, scalar) readonly buffer ElementVertices { uint element_vertices[]; };
layout(set = 0, binding = 11, scalar) writeonly buffer Reflected { vec3 reflected[]; };
layout(push_constant, scalar) uniform Params {
    GlossTarget target;
    vec4 eye;               // position and 1, or the direction to an orthographic eye and 0
    uint first_leaf;
    uint leaf_count;        // of the window
    uint n;
    uint table_side;        // of the senders' tables; 0: they send evenly
    uint has_environment;   // 1: through empty bins
} params;

// Along the bin, not from the winner's centre: of a winner close by, which fills many bins, each shows another part.
vec3 arriving(uint winner, vec3 towards)
{
    if (winner == EMPTY_BIN) return params.has_environment != 0 ? bin_radiance[bin_of(towards, params.n)] : vec3(0.0);
    if ((winner & BACK_SEEN) != 0) return vec3(0.0);
    vec3 radiance = node_radiosity[winner] / PI;
    uint glossy = glossy_of_node[winner];
    if (params.table_side != 0 && glossy != NO_ELEMENT)
        radiance += specular[glossy * 6 * params.table_side * params.table_side + bin_of(-towards, params.table_side)];
    return radiance;
}

void main()
{
    uint directions = direction_count(params.target), i = linear_index();
    if (i >= params.target.count * directions) return;
    uint glossy = params.target.first + i / directions, leaf = glossy_leaves[glossy];
    Receiver at = receivers[leaf];
    uint bin_count = 6 * params.n * params.n;
    LeafGloss lobe = lobes[vertex_of(element_vertices[leaf_elements[leaf]])];
    Surface s = glossy_surface(lobe, at.normal, float(bin_count));
    vec3 to_eye = params.target.side != 0 ? bin_direction(i % directions, params.target.side)
                                          : params.eye.xyz - params.eye.w * at.origin;
    to_eye = normalize(to_eye);
    vec3 sum = vec3(0.0), weights = vec3(0.0);
    if (dot(to_eye, at.normal) > 0.0) {
        vec3 normal = turn_back(at.frame, at.normal);
        for (uint bin = 0; bin < bin_count; ++bin) {
            float cosine = dot(bin_vectors[bin], normal);
            if (cosine <= 0.0) continue;
            vec3 towards = turn(at.frame, normalize(bin_vectors[bin]));
            vec3 weight = cosine * brdf_value(s, to_eye, towards);
            sum += weight * arriving(winners[bin * params.leaf_count + leaf - params.first_leaf], towards);
            weights += weight;
        }
    }
    reflected[glossy * directions + i % directions] =
        specular_albedo(s, dot(s.normal, to_eye)) * sum / max(weights, vec3(1e-20));
}
