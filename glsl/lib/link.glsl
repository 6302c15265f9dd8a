#ifndef LIB_LINK
#define LIB_LINK
// Links of a receiver, row after row, sorted by sender. Weights are form factors, receiver to sender. A link is one word:
// plain in 64 bits, the sender in the lower half and the weight as f32 in the upper; packed in 32, the sender in the upper
// 20 bits and the weight in units of 1/4096 in the lower 12.
const uint PACKED_WEIGHT_BITS = 12u;
const uint PACKED_UNITS = 4096u;

// Before its row is written: the weight in whole units, so that sums do not depend on their order.
struct RowEntry {
    uint sender;
    uint weight;
};
const uint RAY_UNITS = 65536u;      // units of one ray's weight
#endif
