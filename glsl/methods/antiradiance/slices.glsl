#ifndef SLICES
#define SLICES
// Transfers lie in slices: SLICE cells (bins of receivers) of one bin and of like length side by side, the k-th transfer of
// all of them, then the next. Threads side by side then read side by side, and have as much to do.      [Kreutzer2014 SELL]
const uint SLICE = 32;

// Classes of cells by their number of transfers, the longest first: each number its own up to 8, then four to a doubling.
const uint LENGTH_CLASSES = 48;

uint length_class(uint length)
{
    if (length <= 8) return LENGTH_CLASSES - length;
    uint last = length - 1, bit = uint(findMSB(last));
    uint step = 4 * (bit - 3) + (last >> (bit - 2) & 3);
    return LENGTH_CLASSES - 9 - min(step, LENGTH_CLASSES - 9);
}
#endif
