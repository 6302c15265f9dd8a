#ifndef METHODS_SURFACE_SHADOW_MAPS_GATHER
#define METHODS_SURFACE_SHADOW_MAPS_GATHER
// Refine and gather for one texel of the atlas in one walk over the sender tree.            [Ritschel2008 4.3, Fig. 10]
// The kernel that includes this says how it sees, as in display/final_gather.glsl; bindings 0 to 6 and set 1 are its own.
#include "lib/atlas.glsl"
#include "lib/sender_gather.glsl"
#include "lib/texel_gloss.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 7, scalar) readonly buffer Texels { AtlasTexel texels[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Reflectance { vec3 reflectance[]; };
layout(set = 0, binding = 9) uniform usamplerBuffer sender_nodes;       // SENDER_NODE_TEXELS each; compact: one
layout(set = 0, binding = 10) uniform usamplerBuffer sender_light;      // SENDER_LIGHT_TEXELS each
layout(set = 0, binding = 11) uniform usamplerBuffer sender_leaves;     // SENDER_LEAF_TEXELS each
layout(set = 0, binding = 12) uniform usamplerBuffer sender_branches;   // one each
layout(set = 0, binding = 13, scalar) readonly buffer Adaptation { float adaptation[]; };
layout(set = 0, binding = 14, scalar) writeonly buffer Irradiance { vec3 irradiance[]; };
layout(set = 0, binding = 15, scalar) writeonly buffer CutSizes { uint cut_sizes[]; };
layout(set = 0, binding = 16, scalar) readonly buffer TreeFrames { SenderFrame tree_frame[]; };
layout(set = 0, binding = 23, scalar) readonly buffer GlossyRows { uint glossy_rows[]; };   // of texels; 0: none
layout(set = 0, binding = 24, scalar) buffer Arrived { vec3 arrived[]; };                   // by row and bin, W/m2
layout(set = 0, binding = 25, scalar) readonly buffer Shapes { PartShape shapes[]; };
layout(push_constant, scalar) uniform Params {
    uint texel_count;
    uint node_count;
    uint seed;
    uint jitter;
    float ray_offset;           // m
    float threshold;            // of what the display shows, 0..1
    float chance_below;         // of the threshold
    float exposure;
    float key;
    float white;
    uint operator;
    float map_stretch;          // what maps see is looked over by rays this far from the receiver; pixels of a map
} params;

layout(constant_id = 2) const bool COMPACT = false;
bool sender_is_compact() { return COMPACT; }
SenderFrame sender_frame() { return tree_frame[0]; }
uvec4 sender_node_texel(uint i) { return texelFetch(sender_nodes, int(i)); }
uvec4 sender_light_texel(uint i) { return texelFetch(sender_light, int(i)); }
uvec4 sender_leaf_texel(uint i) { return texelFetch(sender_leaves, int(i)); }
uvec4 sender_branch_texel(uint i) { return texelFetch(sender_branches, int(i)); }

// A point drawn on the texel's own surface: a large texel may lie half in the shade.
vec3 drawn_origin(AtlasTexel texel, vec4 u)
{
    uint part = texel.first_part, last = texel.first_part + texel.part_count - 1;
    while (part < last && shapes[part].until < u.z) ++part;
    return part_point(shapes[part], u.xy) + params.ray_offset * texel.normal;
}

void gather_texel()
{
    uint index = linear_index();
    if (index >= params.texel_count) return;

    AtlasTexel texel = texels[index];
    // White, so that what is reflected is the irradiance over pi: dark texels are lit as carefully as bright ones.
    Surface surface = Surface(vec3(1.0), vec3(0.0), 0.0, 1.0, vec3(0.0), texel.normal, true);
    receiver = Receiver(texel.position, texel.normal, texel.normal, surface);
    slack = params.ray_offset;
    float scale = params.exposure * (params.key > 0.0 && adaptation[0] > 0.0 ? params.key / adaptation[0] : 1.0);
    vec3 reflects = reflectance[index];
    scale *= max(reflects.r, max(reflects.g, reflects.b));
    options = GatherOptions(params.threshold, scale, params.white, params.operator, 0.0, params.jitter != 0, 0u, params.chance_below);
    start_showing(0.0);

    uint row = glossy_rows[index], side = sender_frame().gloss_side;
    vec3 origin = texel.position + params.ray_offset * texel.normal;
    vec3 sum = vec3(0.0);
    uint node = 0, visited = 0, cut = 0, most = 4;
    while (node < params.node_count) {
        uint count = next_senders(most, node, params.node_count, visited), k = 0;
        most = more_senders(most);
        cut += count;
        while (true) {
            Arrival arrival;
            bool found = false;
            while (!found && k < count) {
                uint taken = sender_batch[k++];
                float chance;
                arrival = arrival_of(taken, pcg4d(uvec4(index, taken, 2u, params.seed)), chance);
                found = is_worth_asking(arrival, chance);
            }
            if (!found) break;
            if (options.jitter) origin = drawn_origin(texel, unit_interval(pcg4d(uvec4(index, arrival.leaf, 7u, params.seed))));
            vec3 light = visibility(origin, arrival.target, arrival.leaf) * (arrival.direct + arrival.indirect);
            sum += light;
            if (row != 0 && light != vec3(0.0)) {
                vec2 u = unit_interval(pcg4d(uvec4(index, arrival.leaf, 6u, params.seed))).xy;
                arrived[arrival_entry(texel, row, side, normalize(arrival.target - texel.position), u)] += PI * light;
            }
            start_showing(shown_luminance + luminance(light));
        }
    }
    irradiance[index] = PI * sum;
    cut_sizes[index] = cut;
}
#endif
