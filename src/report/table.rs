//! The table of passes printed at exit: launches, milliseconds, share.

use std::fmt::Write as _;

use super::profile::Pass;

/// A fixed-width text table, one line per pass, longest total first. Ends with a line break unless empty.
pub fn render(passes: &[Pass]) -> String {
    if passes.is_empty() {
        return String::new();
    }
    let mut order: Vec<&Pass> = passes.iter().collect();
    order.sort_by(|a, b| b.ms.total.total_cmp(&a.ms.total));
    let total: f64 = passes.iter().map(|pass| pass.ms.total).sum();
    let width = order.iter().map(|pass| pass.path.chars().count()).max().unwrap_or(0).max("pass".len());

    let mut table = String::new();
    let header = ["calls", "ms min", "median", "max", "total", "%"];
    // Writing to a String cannot fail.
    let _ = writeln!(
        table,
        "{:width$} {:>8} {:>10} {:>10} {:>10} {:>11} {:>6}",
        "pass", header[0], header[1], header[2], header[3], header[4], header[5]
    );
    for pass in &order {
        let mark = if pass.overlapped { "~" } else { " " };
        let share = if total > 0.0 { 100.0 * pass.ms.total / total } else { 0.0 };
        let _ = writeln!(
            table,
            "{:width$} {:>8} {mark}{:>9.3} {:>10.3} {:>10.3} {:>11.3} {share:>6.1}",
            pass.path, pass.calls, pass.ms.min, pass.ms.median, pass.ms.max, pass.ms.total
        );
    }
    let calls: u64 = passes.iter().map(|pass| pass.calls).sum();
    let _ =
        writeln!(table, "{:width$} {calls:>8} {:>10} {:>10} {:>10} {total:>11.3} {:>6.1}", "sum", "", "", "", 100.0);
    if order.iter().any(|pass| pass.overlapped) {
        table.push_str("~ ran beside another pass: its times share the GPU\n");
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::profile::summarise;
    use super::super::profile::tests::record;
    use super::*;

    #[test]
    fn passes_are_sorted_and_aligned() {
        let mut records = vec![record("frame", "short", 0, 1_000_000), record("frame", "a longer name", 0, 3_000_000)];
        records[0].overlapped = true;
        let table = render(&summarise(&records));
        let expected = "\
pass                   calls     ms min     median        max       total      %
frame/a longer name        1      3.000      3.000      3.000       3.000   75.0
frame/short                1 ~    1.000      1.000      1.000       1.000   25.0
sum                        2                                        4.000  100.0
~ ran beside another pass: its times share the GPU
";
        assert_eq!(table, expected);
        assert_eq!(render(&[]), "");
    }
}
