#ifndef WORK_CLASSES
// Classes of cells by their number of transfers, two to a doubling, the longest first.
// The kernel binds cell_offsets (ends of cells).
#define WORK_CLASSES 16

uint cell_length(uint cell) { return cell_offsets[cell] - (cell == 0 ? 0 : cell_offsets[cell - 1]); }

uint work_class(uint length)
{
    if (length <= 4) return WORK_CLASSES - length;
    uint last = length - 1, bit = uint(findMSB(last));
    return WORK_CLASSES - 1 - min(2 * bit + (last >> (bit - 1) & 1), WORK_CLASSES - 1);
}
#endif
