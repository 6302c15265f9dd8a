#version 460
#include "lib/prelude.glsl"
#include "lib/sender_pack.glsl"

// One thread per node: the paper's 128 bits of it. Spheres and cones are rounded outwards.   [Ritschel2008 4.2.1]
// reads wide_nodes, sender_light   writes compact_nodes[node_count]   updates tree_frame[1]   shared none
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) uniform usamplerBuffer wide_nodes;        // SENDER_NODE_TEXELS each
layout(set = 0, binding = 1) uniform usamplerBuffer sender_light;      // SENDER_LIGHT_TEXELS each
layout(set = 0, binding = 2, scalar) writeonly buffer CompactNodes { uvec4 compact_nodes[]; };
layout(set = 0, binding = 3, scalar) buffer TreeFrames { SenderFrame tree_frame[]; };
layout(push_constant, scalar) uniform Params { uint node_count; } params;

uvec4 sender_node_texel(uint i) { return texelFetch(wide_nodes, int(i)); }
uvec4 sender_light_texel(uint i) { return texelFetch(sender_light, int(i)); }
bool sender_is_compact() { return false; }
SenderFrame sender_frame() { return tree_frame[0]; }

// Its brightest channel is what the walk takes for the node's power.
vec3 bounding_power(uint i)
{
    uvec4 light = sender_light_texel(SENDER_LIGHT_TEXELS * i);
    vec3 power = uintBitsToFloat(light.xyz);
    float brightest = max(power.r, max(power.g, power.b));
    return brightest > 0.0 ? power * ((brightest + uintBitsToFloat(light.w)) / brightest) : power;
}

void main()
{
    uint i = linear_index();
    if (i >= params.node_count) return;

    // No node has more than the root.
    vec3 all = bounding_power(0);
    float largest_power = max(all.r, max(all.g, all.b));
    if (i == 0) tree_frame[0].largest_power = largest_power;

    SenderNode node = sender_node(i);
    vec3 low = tree_frame[0].low, extent = tree_frame[0].extent;
    float largest_radius = tree_frame[0].largest_radius;
    uvec3 place = uvec3(clamp((node.centre - low) / max(extent, vec3(1e-30)) * 255.0 + 0.5, 0.0, 255.0));
    vec3 moved = low + vec3(place) / 255.0 * extent - node.centre;
    float radius = (node.radius + sqrt(dot(moved, moved))) * 1.0001;
    uint radius_code = uint(clamp(ceil(255.0 + 12.0 * log2(max(radius, 1e-30) / largest_radius)), 0.0, 255.0));

    uvec3 axis = uvec3(clamp((node.axis + 1.0) * 127.0 + 0.5, 0.0, 254.0));
    vec3 rounded = vec3(axis) / 127.0 - 1.0;
    float turned = acos(clamp(dot(rounded, node.axis) / sqrt(dot(rounded, rounded)), -1.0, 1.0));
    float cone = min(acos(clamp(node.cos_cone, -1.0, 1.0)) + turned + 1e-3, PI);
    uint cone_code = uint(clamp(floor((cos(cone) + 1.0) * 127.0), 0.0, 254.0));
    uint area_code = 0;     // the walk needs none: leaves have their own
    compact_nodes[i] = uvec4(place.x | place.y << 8 | place.z << 16 | radius_code << 24,
                             axis.x | axis.y << 8 | axis.z << 16 | cone_code << 24,
                             pack_power(bounding_power(i), largest_power) | area_code << 24,
                             node.skip | sender_leaf(i) << 16);
}
