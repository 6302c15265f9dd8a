//! From the GPU layer's measurements to the plain records that [`crate::report`] writes. The two know nothing of each
//! other; this is where they meet.

use std::collections::BTreeMap;
use std::time::Instant;

use crate::gpu;
use crate::report::profile::{Device, Memory, MemoryOwner, PassRecord};
use crate::report::trace::{Clock, TimeLine};

/// The records of finished passes, in their order.
pub fn pass_records(records: Vec<gpu::PassRecord>) -> Vec<PassRecord> {
    let convert = |record: gpu::PassRecord| PassRecord {
        path: record.path,
        name: record.name.to_owned(),
        start_ns: record.start_ns,
        end_ns: record.end_ns,
        bytes_read: record.bytes_read,
        bytes_written: record.bytes_written,
        counters: record.counters.into_iter().map(|(name, count)| (name.to_owned(), count)).collect(),
        overlapped: record.overlapped,
    };
    records.into_iter().map(convert).collect()
}

/// The device as profiles name it.
pub fn device(info: &gpu::DeviceInfo) -> Device {
    Device {
        name: info.name.clone(),
        driver: info.driver.clone(),
        kind: info.kind.to_owned(),
        api: info.api_version.clone(),
    }
}

/// Device memory by owner. The sum of the peaks is an upper bound of the peak: owners may peak at different times.
pub fn memory(owners: &BTreeMap<String, gpu::MemoryUse>) -> Memory {
    let owner = |(owner, used): (&String, &gpu::MemoryUse)| MemoryOwner {
        owner: owner.clone(),
        bytes: used.current_bytes,
        peak_bytes: used.peak_bytes,
    };
    let owners: Vec<MemoryOwner> = owners.iter().map(owner).collect();
    Memory {
        bytes: owners.iter().map(|owner| owner.bytes).sum(),
        peak_bytes: owners.iter().map(|owner| owner.peak_bytes).sum(),
        owners,
    }
}

/// Where the device's clock lies on the time line.
pub fn clock(context: &gpu::Context, time_line: &TimeLine) -> Clock {
    time_line.calibrate(|| context.calibrate().map(|pair| (pair.device_ns, pair.max_deviation_ns)))
}

/// Since `start`, on the CPU's clock.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_keep_every_figure() {
        let record = gpu::PassRecord {
            path: "frame/gather/links".into(),
            name: "gather/links",
            start_ns: 5,
            end_ns: 9,
            bytes_read: 3,
            bytes_written: 4,
            counters: vec![("threads", 64)],
            overlapped: true,
        };
        let converted = pass_records(vec![record]);
        let expected = PassRecord {
            path: "frame/gather/links".into(),
            name: "gather/links".into(),
            start_ns: 5,
            end_ns: 9,
            bytes_read: 3,
            bytes_written: 4,
            counters: vec![("threads".into(), 64)],
            overlapped: true,
        };
        assert_eq!(converted, [expected]);
    }

    #[test]
    fn memory_sums_its_owners() {
        let used = |current_bytes, peak_bytes| gpu::MemoryUse { current_bytes, peak_bytes };
        let owners = BTreeMap::from([("bvh".to_owned(), used(1, 10)), ("links".to_owned(), used(2, 20))]);
        let memory = memory(&owners);
        assert_eq!((memory.bytes, memory.peak_bytes, memory.owners.len()), (3, 30, 2));
    }
}
