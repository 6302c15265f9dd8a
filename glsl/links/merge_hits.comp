#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/link.glsl"
#include "lib/ray.glsl"

// One workgroup per element: its rays' hits become a row of (sender, weight), each sender once, in rising order; each hit
// counts for the corners of its triangle by the barycentric weights.                              [Schmitz2008 3.2]
// reads hits[batch_count * RAYS], triangles, back_elements[vertex_count]
// writes row_entries[batch_count * 3 RAYS], row_counts[batch_count], escaped (a bit per ray, element_count * WORDS),
// outcomes[element_count] (blocked rays | escaped rays << 16)   shared 30 bytes per ray
// Differs from [Schmitz2008]: merged on the device, by a hash table over senders; then each entry counts the smaller ones
// for its place, so that the row is in order whatever the order of arrival. Weights are integers: their sums are exact.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RAYS = 256;      // per element, at most 1024
layout(set = 0, binding = 0, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { uvec3 triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer BackElements { uint back_elements[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer RowEntries { RowEntry row_entries[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer RowCounts { uint row_counts[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Escaped { uint escaped[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Outcomes { uint outcomes[]; };
layout(push_constant, scalar) uniform Params {
    uint first_element;
    uint batch_count;
    uint unit_divisor;      // entries are written in this many units of 1 / (65536 RAYS)
} params;

const uint CAPACITY = 3 * RAYS;
const uint WORDS = (RAYS + 31) / 32;
const uint FREE = 0xffffffffu;

shared uint sh_senders[CAPACITY];           // FREE or a sender, at a slot found by its hash
shared uint sh_weights[CAPACITY];
shared uint sh_slots[(CAPACITY + 1) / 2];   // slots in use by arrival, two 16-bit indices a word
shared uint sh_escaped[WORDS];
shared uint sh_count;
shared uint sh_blocked;
shared uint sh_escaped_count;

uint slot_at(uint index) { return sh_slots[index / 2] >> (index % 2 * 16) & 0xffffu; }

void add_weight(uint sender, uint weight)
{
    if (weight == 0) return;
    uint slot = (sender * 2654435761u >> 8) % CAPACITY;
    while (true) {
        uint seen = atomicCompSwap(sh_senders[slot], FREE, sender);
        if (seen == FREE) {
            uint index = atomicAdd(sh_count, 1);
            atomicOr(sh_slots[index / 2], slot << (index % 2 * 16));
        }
        if (seen == FREE || seen == sender) {
            atomicAdd(sh_weights[slot], weight);
            return;
        }
        slot = slot + 1 == CAPACITY ? 0 : slot + 1;
    }
}

void add_hit(Hit hit)
{
    uvec3 senders = triangles[triangle_index(hit)];
    if (is_back_face(hit)) {
        senders = uvec3(back_elements[senders.x], back_elements[senders.y], back_elements[senders.z]);
        if (senders.x == NO_ELEMENT) {
            atomicAdd(sh_blocked, 1);
            return;
        }
    }
    // Rounded so that the three add up to one ray.
    vec2 b = clamp(hit.barycentrics, 0.0, 1.0) * float(RAY_UNITS);
    uint second = min(uint(b.x + 0.5), RAY_UNITS);
    uint third = min(uint(b.y + 0.5), RAY_UNITS - second);
    add_weight(senders.x, RAY_UNITS - second - third);
    add_weight(senders.y, second);
    add_weight(senders.z, third);
}

uint rounded(uint weight) { return (weight + params.unit_divisor / 2) / params.unit_divisor; }

void main()
{
    uint row = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    if (row >= params.batch_count) return;
    uint thread = gl_LocalInvocationID.x;

    for (uint k = thread; k < CAPACITY; k += 64) {
        sh_senders[k] = FREE;
        sh_weights[k] = 0;
        if (k < (CAPACITY + 1) / 2) sh_slots[k] = 0;
        if (k < WORDS) sh_escaped[k] = 0;
    }
    if (thread == 0) sh_count = sh_blocked = sh_escaped_count = 0;
    barrier();

    // Collect the hits.
    for (uint ray = thread; ray < RAYS; ray += 64) {
        Hit hit = hits[row * RAYS + ray];
        if (is_hit(hit)) {
            add_hit(hit);
        } else {
            atomicOr(sh_escaped[ray / 32], 1u << ray % 32);
            atomicAdd(sh_escaped_count, 1);
        }
    }
    barrier();

    // Put each sender at its place. A packed row keeps its sum: each entry takes the difference of rounded sums.
    uint count = sh_count;
    for (uint k = thread; k < count; k += 64) {
        uint slot = slot_at(k);
        uint sender = sh_senders[slot], weight = sh_weights[slot];
        uint rank = 0, before = 0;
        for (uint other = 0; other < count; ++other) {
            uint at = slot_at(other);
            bool is_smaller = sh_senders[at] < sender;
            rank += uint(is_smaller);
            before += is_smaller ? sh_weights[at] : 0;
        }
        row_entries[row * CAPACITY + rank] = RowEntry(sender, rounded(before + weight) - rounded(before));
    }
    uint element = params.first_element + row;
    for (uint k = thread; k < WORDS; k += 64) escaped[element * WORDS + k] = sh_escaped[k];
    if (thread == 0) {
        row_counts[row] = count;
        outcomes[element] = sh_blocked | sh_escaped_count << 16;
    }
}
