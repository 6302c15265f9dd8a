#version 460
#include "lib/prelude.glsl"
#include "lib/element.glsl"
#include "lib/link.glsl"
#include "lib/ray.glsl"

// One workgroup per element: its rays' hits become a row of (sender, weight), each sender once, in rising order; each hit
// counts for the corners of its triangle by the barycentric weights.                              [Schmitz2008 3.2]
// reads hits[batch_count * RAYS], triangles, back_elements[vertex_count]
// writes row_entries[batch_count * 3 RAYS], row_counts[batch_count], escaped (a bit per ray, element_count * WORDS),
// outcomes[element_count] (blocked rays | escaped rays << 16)   shared 30 bytes per ray and the buckets
// Differs from [Schmitz2008]: merged on the device, by a hash table over senders, then sorted by buckets of sender
// indices. The row does not depend on the order of arrival: weights are integers, and no two keys are equal.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint RAYS = 256;      // per element, at most 1024
layout(constant_id = 1) const uint BUCKETS = 1024;  // a multiple of 64
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
    uint sender_count;
} params;

const uint CAPACITY = 3 * RAYS;
const uint WORDS = (RAYS + 31) / 32;
const uint FREE = 0xffffffffu;

shared uint sh_senders[CAPACITY];           // FREE or a sender, at a slot found by its hash
shared uint sh_weights[CAPACITY];
shared uint sh_slots[(CAPACITY + 1) / 2];   // slots in use by bucket, two 16-bit indices a word
shared uint sh_buckets[BUCKETS];            // sizes, then starts, then ends
shared uint sh_escaped[WORDS];
shared uint sh_totals[64];
shared uint sh_blocked;
shared uint sh_escaped_count;

// Rises with the sender, so that buckets are in order.
uint bucket_of(uint sender)
{
    return min(uint(float(sender) * (float(BUCKETS) / float(params.sender_count))), BUCKETS - 1);
}

uint slot_at(uint index) { return sh_slots[index / 2] >> (index % 2 * 16) & 0xffffu; }

void add_weight(uint sender, uint weight)
{
    if (weight == 0) return;
    uint slot = (sender * 2654435761u >> 8) % CAPACITY;
    while (true) {
        uint seen = atomicCompSwap(sh_senders[slot], FREE, sender);
        if (seen == FREE) atomicAdd(sh_buckets[bucket_of(sender)], 1);
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
    uvec3 weights = uvec3(RAY_UNITS - second - third, second, third);
    for (uint k = 0; k < 3; ++k) add_weight(senders[k], weights[k]);
}

void main()
{
    uint row = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    if (row >= params.batch_count) return;
    uint thread = gl_LocalInvocationID.x;

    for (uint k = thread; k < max(CAPACITY, BUCKETS); k += 64) {
        if (k < CAPACITY) {
            sh_senders[k] = FREE;
            sh_weights[k] = 0;
        }
        if (k < (CAPACITY + 1) / 2) sh_slots[k] = 0;
        if (k < BUCKETS) sh_buckets[k] = 0;
        if (k < WORDS) sh_escaped[k] = 0;
    }
    if (thread == 0) sh_blocked = sh_escaped_count = 0;
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

    // Turn the sizes of the buckets into starts.
    const uint SHARE = BUCKETS / 64;
    uint total = 0;
    for (uint k = thread * SHARE; k < (thread + 1) * SHARE; ++k) {
        uint size = sh_buckets[k];
        sh_buckets[k] = total;
        total += size;
    }
    sh_totals[thread] = total;
    barrier();
    uint start = 0;
    for (uint k = 0; k < thread; ++k) start += sh_totals[k];
    for (uint k = thread * SHARE; k < (thread + 1) * SHARE; ++k) sh_buckets[k] += start;
    uint count = 0;
    for (uint k = 0; k < 64; ++k) count += sh_totals[k];
    barrier();

    // Fill the buckets; each start moves to its bucket's end.
    for (uint slot = thread; slot < CAPACITY; slot += 64) {
        uint sender = sh_senders[slot];
        if (sender == FREE) continue;
        uint index = atomicAdd(sh_buckets[bucket_of(sender)], 1);
        atomicOr(sh_slots[index / 2], slot << (index % 2 * 16));
    }
    barrier();

    // Within its bucket, an entry stands behind the smaller ones.
    for (uint k = thread; k < count; k += 64) {
        uint slot = slot_at(k);
        uint sender = sh_senders[slot];
        uint bucket = bucket_of(sender);
        uint first = bucket == 0 ? 0 : sh_buckets[bucket - 1];
        uint rank = first;
        for (uint other = first; other < sh_buckets[bucket]; ++other)
            rank += uint(sh_senders[slot_at(other)] < sender);
        row_entries[row * CAPACITY + rank] = RowEntry(sender, sh_weights[slot]);
    }
    uint element = params.first_element + row;
    for (uint k = thread; k < WORDS; k += 64) escaped[element * WORDS + k] = sh_escaped[k];
    if (thread == 0) {
        row_counts[row] = count;
        outcomes[element] = sh_blocked | sh_escaped_count << 16;
    }
}
