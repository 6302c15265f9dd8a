#ifndef LIB_TRANSFER
#define LIB_TRANSFER
// What one link carries between two entries of the tables (bin x nodes + node), before it stands among its cell's.
struct FoundTransfer {
    uint cell;          // the receiver's entry
    uint entry;         // the sender's
    float weight;       // incident radiance for the sender's exitant intensity per area
};
#endif
