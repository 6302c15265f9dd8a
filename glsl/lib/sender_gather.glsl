#ifndef LIB_SENDER_GATHER
#define LIB_SENDER_GATHER
// What a receiver takes from the nodes of its cut: the oracle of the walk, and the light of a node by one of its leaves.
// The kernel binds the tables of lib/sender_tree.glsl and lib/sender_leaf.glsl.
#include "lib/random.glsl"
#include "lib/sender_gloss.glsl"
#include "lib/sender_point.glsl"
#include "lib/sender_walk.glsl"
#include "lib/tone_curve.glsl"

struct GatherOptions {
    float threshold;            // of what the display shows, 0..1
    float scale;                // from radiance to what the tone curve takes
    float white;
    uint operator;
    float clamp_radii;          // senders stand at least so many of their radii away; 0: they are measured exactly
    bool jitter;
    uint sample_index;
    float chance_below;         // of the threshold: what would change the picture by less is asked by chance; 0: never
};
GatherOptions options;

Receiver receiver;
vec2 lobe_draw;         // 0..1, of all senders alike: what of the specular lobe misses one of them hits another
float slack;            // how far rounding may have moved the receiver, metres
float shown;            // what the pixel shows so far, as the display encodes it
float shown_luminance;
float least_change;     // luminance that would change what is shown by the threshold

// The scaled luminance that is shown as white.
float white_luminance()
{
    return options.operator == TONE_REINHARD ? options.white : options.operator == TONE_FILMIC ? 5.6 : 1.0;
}

// What the display shows of a luminance. Beyond its white, where it shows nothing more, shares count as they do below: the
// picture may be shown darker later.
float shown_value(float luminance)
{
    float x = options.scale * luminance, white = white_luminance();
    return display_value(x, options.operator, options.white) + (x > white ? log(x / white) / 2.4 : 0.0);
}

// The curve is inverted here, once for each light that was taken, so that the walk compares luminances.
void start_showing(float luminance_so_far)
{
    shown_luminance = luminance_so_far;
    shown = shown_value(luminance_so_far);
    float value = shown + options.threshold;
    float x = value < 1.0 ? luminance_shown_as(value, options.operator, options.white) : white_luminance() * exp(2.4 * (value - 1.0));
    least_change = options.scale <= 0.0 ? 1e38 : options.threshold <= 0.0 ? 0.0 : max(x / options.scale - luminance_so_far, 0.0);
}

float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

// Refine where all of the node's light, gone wrong, would show.                                 [Ritschel2008 4.3]
// Differs from [Ritschel2008]: on top of what the pixel shows already, where the curve is flatter than at black.
uint sender_decision(SenderNode node, bool is_leaf)
{
    float bound = largest_radiance(node, receiver);
    if (bound <= 0.0) return SENDER_IGNORE;
    return !is_leaf && bound > least_change ? SENDER_REFINE : SENDER_TAKE;
}

// One ray's worth of light: what the eye sees of it if nothing is in between.
struct Arrival {
    vec3 direct;        // W m^-2 sr^-1: emitted by the sender itself
    vec3 indirect;
    vec3 lost;          // what clamping took from both
    vec3 target;
    uint leaf;
};

// Drops an arrival that would hardly show with a chance, `u` in 0..1 deciding, and lets the others of its kind stand for it:
// a ray costs the same whatever it brings. Right in the mean.                                              [Arvo1990]
// Differs from [Ritschel2008]: there the visibility of every node of the cut is asked.
bool is_worth_asking(inout Arrival arrival, float u)
{
    vec3 light = arrival.direct + arrival.indirect;
    if (light + arrival.lost == vec3(0.0)) return false;
    if (options.chance_below <= 0.0) return true;
    float change = shown_value(shown_luminance + luminance(light)) - shown;
    float full = options.chance_below * options.threshold;
    if (change >= full) return true;
    float chance = max(change / full, 0.01);
    if (u >= chance) return false;
    arrival.direct /= chance;
    arrival.indirect /= chance;
    arrival.lost /= chance;
    return true;
}

// How far before a leaf's own surface a way to it ends, metres: a hit there is rounded by the coordinates of the triangle's
// corners and of both ends, which are at most as large as the tree reaches. Those of the leaf itself say nothing: a floor
// about the origin shadowed itself there.                                                  As in lib/offset.glsl.
float end_offset()
{
    SenderFrame frame = sender_frame();
    vec3 reach = max(max(abs(frame.low), abs(frame.low + frame.extent)), abs(receiver.position));
    return max(reach.x, max(reach.y, reach.z)) * (1.0 / 524288.0);
}

// The light of a node of the cut, by a leaf that is drawn from it, or by its representative; `chance` is left over.
Arrival arrival_of(uint node, uvec4 random, out float chance)
{
    vec4 u = vec4(0.5);
    if (options.jitter) u = fract(unit_interval(random) + float(options.sample_index) * vec4(0.7548777, 0.5698403, 0.6180340, 0.3247180));
    chance = u.w;
    uint slot;
    vec3 emitted, reflected;    // as if all of the node's power came from the leaf, W/m2
    vec3 by_lobe;               // of what the leaf's lobe sends
    if (options.jitter) {
        float probability;
        slot = draw_leaf(node, u.z, probability);
        LeafLight light = sender_leaf_light(slot);
        emitted = light.emitted / probability;
        reflected = light.reflected / probability;
        by_lobe = vec3(1.0 / probability);
    } else {
        slot = sender_leaf(node);
        float area = leaf_area(sender_shape(slot));
        emitted = sender_emitted_power(node) / area;
        reflected = uintBitsToFloat(sender_light_texel(SENDER_LIGHT_TEXELS * node).xyz) / area - emitted;
        by_lobe = vec3(0.0);
    }
    uint row = sender_gloss_row(slot);
    if (row != 0 && !options.jitter) {
        // All of it by the leaf's own directions.
        vec3 even = sender_leaf_light(slot).reflected, all = even + sender_gloss_radiosity(sender_frame(), row);
        by_lobe = mix(vec3(0.0), reflected / max(all, vec3(1e-30)), greaterThan(all, vec3(0.0)));
        reflected = mix(reflected, even * by_lobe, greaterThan(all, vec3(0.0)));
    }

    Arrival none = Arrival(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), slot);
    SenderLeaf leaf = sender_shape(slot);
    vec3 sender_normal = leaf_normal(leaf);
    // A leaf in the receiver's own plane is not in front of it, whatever rounding says.
    if (dot(sender_normal, receiver.position - leaf.centre) <= slack) return none;
    SenderPoint point;
    if (!draw_point(leaf, receiver, sender_normal, u.xyz, lobe_draw, options.jitter, point)) return none;
    vec3 lost, light = reflected_light(leaf, receiver, sender_normal, options.clamp_radii, point, lost);
    // As much evenly sent would be the same light here.
    if (row != 0 && by_lobe != vec3(0.0))
        reflected += PI * by_lobe * sender_gloss_radiance(sender_frame(), row, on_leaf_axes(leaf, sender_normal, -point.to / sqrt(dot(point.to, point.to))));
    vec3 target = receiver.position + point.to + end_offset() * sender_normal;
    return Arrival(light * emitted, light * reflected, lost * (emitted + reflected), target, slot);
}
#endif
