//! The order of a plan: observable passes by the time they need, who stands in whose way, a schedule without overlaps.

use crate::base::time::parse_utc;
use crate::tables::PlanRow;
use crate::tables::words::PlanStatus;

/// Sorts the rows, observable ones first, and fills rank, conflicts and schedule.
///
/// The schedule is greedy: pass by pass in the order of rank, each that overlaps none already in it.
pub fn rank(rows: &mut [PlanRow], slew_s: f64) {
    let observable = |row: &PlanRow| row.status == PlanStatus::Observable;
    rows.sort_by(|a, b| {
        let by_status = observable(b).cmp(&observable(a));
        let needed = |row: &PlanRow| row.needed_exptime_s.unwrap_or(f64::INFINITY);
        let by_need = needed(a).total_cmp(&needed(b));
        let by_time = a.date_beg.cmp(&b.date_beg).then(a.norad_cat_id.cmp(&b.norad_cat_id));
        by_status.then(by_need).then(by_time)
    });
    let n = rows.iter().take_while(|row| observable(row)).count();
    let second = |text: &str| parse_utc("date", text).map_or(f64::NAN, |epoch| 86_400.0 * epoch.to_mjd_utc_days());
    let spans: Vec<[f64; 2]> = rows[..n].iter().map(|r| [second(&r.date_beg), second(&r.date_end)]).collect();
    let overlap = |a: [f64; 2], b: [f64; 2]| a[0] < b[1] + slew_s && b[0] < a[1] + slew_s;

    // by start, so that only neighbours in time are compared
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| spans[*a][0].total_cmp(&spans[*b][0]));
    let (mut count, mut first) = (vec![0i64; n], vec![usize::MAX; n]);
    for (k, &i) in order.iter().enumerate() {
        for &j in order[k + 1..].iter().take_while(|j| spans[**j][0] < spans[i][1] + slew_s) {
            if overlap(spans[i], spans[j]) {
                for (me, other) in [(i, j), (j, i)] {
                    count[me] += 1;
                    first[me] = first[me].min(other);
                }
            }
        }
    }
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for (i, row) in rows[..n].iter_mut().enumerate() {
        row.rank = i64::try_from(i + 1).ok();
        row.n_conflicts = count[i];
        row.conflicts_with = i64::try_from(first[i]).ok().filter(|_| count[i] > 0).map(|j| j + 1);
        if !taken.iter().any(|span| overlap(*span, spans[i])) {
            taken.push(spans[i]);
            row.scheduled = 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(needed_exptime_s: f64, beg: u32, end: u32) -> PlanRow {
        let time = |minute: u32| format!("2025-06-10T10:{minute:02}:00Z");
        PlanRow {
            status: PlanStatus::Observable.into(),
            needed_exptime_s: Some(needed_exptime_s),
            date_beg: time(beg),
            date_end: time(end),
            ..PlanRow::default()
        }
    }

    #[test]
    fn the_best_goes_first_and_what_overlaps_it_waits() {
        let faint = PlanRow { status: PlanStatus::Faint.into(), ..row(1e-9, 0, 50) };
        // the second overlaps the first; the third comes after the second by the time to slew, or by less
        let mut rows = vec![row(3.0, 16, 20), faint, row(1.0, 5, 12), row(2.0, 10, 15)];
        rank(&mut rows, 60.0);
        let of = |r: &PlanRow| (r.rank, r.scheduled, r.conflicts_with, r.n_conflicts);
        assert_eq!(
            rows.iter().map(of).collect::<Vec<_>>(),
            [(Some(1), 1, Some(2), 1), (Some(2), 0, Some(1), 1), (Some(3), 1, None, 0), (None, 0, None, 0),]
        );
        // a longer slew, and the second stands in the way of the third, not the first
        rank(&mut rows, 61.0);
        let after: Vec<_> = rows.iter().map(of).collect();
        assert_eq!(after[..3], [(Some(1), 1, Some(2), 1), (Some(2), 0, Some(1), 2), (Some(3), 1, Some(2), 1)]);
    }
}
