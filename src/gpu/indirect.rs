//! Passes over lists whose length only the device knows.
//!
//! An earlier pass leaves the number of threads; [`Recorder::count_groups`] makes workgroups of it that are within the
//! device's limit, whatever the number is, and [`Recorder::dispatch_indirect`] runs a pass over them.

use super::Buffer;
use super::context::Context;
use super::error::GpuError;
use super::hazards::Access;
use super::pass::{Bindings, Pass};
use super::recorder::Recorder;
use super::shaders::indirect as passes;

/// Workgroup counts (x, y, z) that the device worked out, for shaders of one workgroup size. Nothing else writes them.
pub struct GroupCounts {
    counts: Buffer<u32>,
    group_size: u32,
}

impl Context {
    /// Counts for shaders with workgroups of `group_size` threads in x; none before [`Recorder::count_groups`].
    pub fn group_counts(&self, name: &str, group_size: u32) -> Result<GroupCounts, GpuError> {
        if group_size == 0 {
            return Err(GpuError::Refused(format!("{name}: workgroups of no threads")));
        }
        Ok(GroupCounts { counts: self.upload(name, &[0; 3])?, group_size })
    }
}

impl Recorder<'_> {
    /// The workgroups of as many threads as an earlier pass left at `thread_counts[index]`.
    pub fn count_groups(&mut self, groups: &GroupCounts, thread_counts: &Buffer<u32>, index: usize) {
        if index >= thread_counts.len() {
            let message = format!("indirect thread count at {index} of {}", thread_counts.len());
            return self.fail(GpuError::Refused(message));
        }
        let params = passes::CountGroupsParams {
            index: index as u32,
            group_size: groups.group_size,
            most: self.context().limits().workgroup_count,
        };
        self.dispatch(&passes::CountGroups { thread_counts, groups: &groups.counts, params }, 1u32);
    }

    /// Runs a compute pass over the workgroups that [`Recorder::count_groups`] left.
    pub fn dispatch_indirect<P: Pass>(&mut self, pass: &P, groups: &GroupCounts) {
        if P::PROGRAM.workgroup != [groups.group_size, 1, 1] {
            let (name, size) = (P::PROGRAM.name, P::PROGRAM.workgroup);
            let message =
                format!("{name}: workgroups of {size:?} threads, they were counted for {}", groups.group_size);
            return self.fail(GpuError::Refused(message));
        }
        let mut bindings = Bindings::default();
        pass.bind(&mut bindings);
        let access = Access { id: groups.counts.id(), reads: true, writes: false };
        let raw = groups.counts.raw();
        self.compute(P::PROGRAM, &bindings, &[access], None, 0, |device, commands| {
            // SAFETY: the buffer holds three counts within the limits, which count_groups alone writes, and allows
            // indirect use.
            unsafe { device.raw.cmd_dispatch_indirect(commands, raw, 0) }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::Options;
    use super::*;

    /// Groups that cover the threads, within the limit and in the fewest rows.
    fn twin(threads: u32, group_size: u32, most: u32) -> [u32; 3] {
        let wanted = threads.div_ceil(group_size);
        let rows = wanted.div_ceil(most).max(1);
        [wanted.div_ceil(rows), rows.min(most), 1]
    }

    #[test]
    fn whatever_a_pass_leaves_stays_within_the_limit() {
        let context = Context::new(Options { validation: true, ..Options::default() }).unwrap();
        let most = context.limits().workgroup_count;
        let counts = [0, 1, 63, 64, 65, most, most * 64, most * 64 + 1, u32::MAX - 1, u32::MAX];
        let threads = context.upload("test/threads", &counts).unwrap();
        for group_size in [1, 64, 256] {
            let groups = context.group_counts("test/groups", group_size).unwrap();
            for (index, &count) in counts.iter().enumerate() {
                let mut recorder = context.recorder("test").unwrap();
                recorder.count_groups(&groups, &threads, index);
                recorder.submit().unwrap();
                let found = context.download(&groups.counts).unwrap();
                assert_eq!(found, twin(count, group_size, most), "{count} threads by {group_size}");
                assert!(found.iter().all(|&groups| groups <= most));
                let reached: u64 =
                    found.iter().map(|&groups| u64::from(groups)).product::<u64>() * u64::from(group_size);
                assert!(reached >= u64::from(count).min(u64::from(most) * u64::from(most)), "{count} by {group_size}");
            }
        }
        assert_eq!(context.validation_messages(), [""; 0]);
    }
}
