#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""scripts/bench_compare.py, bench_page.py and the tables between them, on made-up results: no clock decides here."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
HEADER = "benchmark,quantity,unit,runs,median,least,most\n"
MACHINE = "# processor: a made-up one\n# load: 0.00\n"


def run(script, *arguments):
    return subprocess.run([sys.executable, "-B", SCRIPTS / script, *map(str, arguments)],
                          capture_output=True, text=True, check=False)


class Folder(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)

    def table(self, name, *rows, header=HEADER, machine=MACHINE):
        file = self.folder / name
        file.write_text(machine + header + "".join(row + "\n" for row in rows))
        return file


class Compare(Folder):
    def compare(self, before, after, *options):
        return run("bench_compare.py", self.table("before.csv", before), self.table("after.csv", after), *options)

    def test_slower_by_more_than_the_noise_is_named(self):
        done = self.compare("frame/a,p50_ns,ns,3,100,95,105", "frame/a,p50_ns,ns,3,130,128,133")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("slower: 1\n  frame/a  p50_ns  100 -> 130 ns  +30.0 %  (noise 15)", done.stdout)

    def test_slower_within_the_noise_is_not(self):
        done = self.compare("frame/a,p50_ns,ns,3,100,80,120", "frame/a,p50_ns,ns,3,130,128,133")
        self.assertEqual((done.returncode, "slower" in done.stdout), (0, False), done.stdout)

    def test_slower_by_little_is_not(self):
        done = self.compare("frame/a,p50_ns,ns,3,100,100,100", "frame/a,p50_ns,ns,3,104,104,104")
        self.assertEqual(done.returncode, 0, done.stdout)
        done = self.compare("frame/a,p50_ns,ns,3,100,100,100", "frame/a,p50_ns,ns,3,104,104,104", "--least", "3")
        self.assertEqual(done.returncode, 1, done.stdout)

    def test_instructions_have_no_noise(self):
        done = self.compare("instructions/a,frame,instructions,1,1000,1000,1000",
                            "instructions/a,frame,instructions,1,1002,1002,1002")
        self.assertEqual(done.returncode, 1, done.stdout)

    def test_faster_is_no_failure(self):
        done = self.compare("frame/a,p50_ns,ns,3,100,95,105", "frame/a,p50_ns,ns,3,50,49,51")
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("faster: 1\n  frame/a", done.stdout)

    def test_maxima_and_what_is_no_time_are_not_compared(self):
        kept = "frame/a,p50_ns,ns,3,100,95,105\n"
        done = self.compare(kept + "frame/a,max_ns,ns,3,1,1,1\nframe/a,off_um,um,3,1,1,1",
                            kept + "frame/a,max_ns,ns,3,9,9,9\nframe/a,off_um,um,3,9,9,9")
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_what_only_one_table_has_is_named(self):
        done = self.compare("frame/a,time,ns,3,1,1,1\nframe/old,time,ns,3,1,1,1",
                            "frame/a,time,ns,3,1,1,1\nframe/new,time,ns,3,1,1,1")
        self.assertEqual(done.returncode, 4, done.stdout)
        self.assertIn("only before: 1\n  frame/old  all time\nonly after: 1\n  frame/new  all time\n", done.stdout)

    def test_numbers_that_are_lost_are_named_and_no_success(self):
        # Seen: four of a benchmark's five numbers were gone, and exit status 0 without a word.
        kept = "frame/a,time,ns,3,1,1,1"
        lost = "frame/a,p50_ns,ns,3,1,1,1\nframe/a,p99_ns,ns,3,1,1,1"
        done = self.compare(f"{kept}\n{lost}", kept)
        self.assertEqual(done.returncode, 4, done.stdout)
        self.assertIn("only before: 2\n  frame/a  p50_ns, p99_ns\n", done.stdout)
        self.assertEqual(self.compare(kept, f"{kept}\n{lost}").returncode, 0)
        slower = self.compare(f"frame/b,time,ns,3,1,1,1\n{lost}", "frame/b,time,ns,3,9,9,9")
        self.assertEqual(slower.returncode, 1, slower.stdout)

    def test_beyond_the_noise_is_not_said_to_be_within_it(self):
        # Seen: 140 -> 420 ns with a noise of 164 was "the same within the noise" with --least 500.
        done = self.compare("frame/a,time,ns,3,140,100,182", "frame/a,time,ns,3,420,400,482", "--least", "500")
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("no more than --least (500 %, instructions 0.1 %): 1\nthe same within the noise: 0\n",
                      done.stdout)

    def test_one_run_says_nothing_of_its_noise(self):
        done = self.compare("frame/a,time,ns,1,100,100,100", "frame/a,time,ns,3,130,128,133")
        self.assertEqual(done.returncode, 1)
        self.assertIn("100 -> 130 ns  +30.0 %  (noise not known: one run)", done.stdout)
        self.assertIn("1 of 1 numbers are of one run, whose noise is not known", done.stderr)
        done = self.compare("i/a,frame,instructions,1,10,10,10", "i/a,frame,instructions,1,10,10,10")
        self.assertEqual(done.stderr, "")

    def test_another_machine_is_said(self):
        before = self.table("before.csv", "frame/a,time,ns,3,1,1,1")
        after = self.table("after.csv", "frame/a,time,ns,3,1,1,1", machine="# processor: another\n")
        done = run("bench_compare.py", before, after)
        self.assertEqual(done.returncode, 0)
        self.assertIn("processor differs: a made-up one / another; times are not comparable", done.stderr)


class BadTables(Folder):
    GOOD = "frame/a,time,ns,3,1,1,1"

    def refused(self, file, words):
        done = run("bench_compare.py", self.table("good.csv", self.GOOD), file)
        self.assertEqual(done.returncode, 3, done.stdout + done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(f"bench_compare.py: {file}{words}", done.stderr)

    def test_missing(self):
        self.refused(self.folder / "none.csv", ": cannot be read (No such file or directory); give a table")

    def test_empty(self):
        file = self.folder / "empty.csv"
        file.write_text("")
        self.refused(file, ": no rows; give a table of ./palpate.sh bench")
        self.refused(self.table("header.csv"), ": no rows")

    def test_another_column(self):
        self.refused(self.table("a.csv", self.GOOD, header="benchmark,quantity,unit,runs,mean,least,most\n"),
                     ":3: the columns are benchmark,quantity,unit,runs,mean,least,most; they have to be")

    def test_a_column_too_few(self):
        self.refused(self.table("b.csv", "frame/a,time,ns,3,1,1"), ":4: 6 columns, not the 7 of the header")

    def test_no_number(self):
        self.refused(self.table("c.csv", "frame/a,time,ns,3,fast,1,1"), ':4: median is "fast", no number')
        self.refused(self.table("d.csv", "frame/a,time,ns,3,nan,1,1"), ':4: median is "nan", no number')

    def test_out_of_order(self):
        self.refused(self.table("e.csv", "frame/a,time,ns,3,5,6,7"), ":4: least 6, median 5, most 7 of 3 runs")

    def test_binary(self):
        file = self.folder / "f.csv"
        file.write_bytes(b"\xff\xfe\x00")
        self.refused(file, ": cannot be read (it is no text)")

    def test_nothing_in_common(self):
        self.refused(self.table("g.csv", "other,time,ns,3,1,1,1"), ": no row in common with")

    def test_another_unit(self):
        self.refused(self.table("h.csv", "frame/a,time,us,3,1,1,1"), ": frame/a time is in us, before in ns")

    def test_a_row_twice(self):
        self.refused(self.table("i.csv", self.GOOD, "frame/b,time,ns,3,1,1,1", "frame/a,time,ns,3,9,9,9"),
                     ":6: frame/a time is in line 4 already; write the table anew")

    def test_usage(self):
        self.assertEqual(run("bench_compare.py").returncode, 2)


class Instructions(unittest.TestCase):
    def test_numbers_that_make_no_sense_are_usage(self):
        for option, value in (("--jobs", "0"), ("--functions", "-1"), ("--csv", "/nowhere/x.csv")):
            done = run("bench_instructions.py", option, value)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(f"error: {option} {value}: ", done.stderr)


def repetition(name, number, **counters):
    return {"name": name, "run_name": f"{name}/iterations:1/manual_time", "run_type": "iteration",
            "real_time": number, "cpu_time": 0.0, "time_unit": "us", **counters}


class Page(Folder):
    def write(self, program, *runs):
        text = json.dumps({"context": {"mhz_per_cpu": 1000, "caches": [], "load_avg": [0.5]}, "benchmarks": runs})
        (self.folder / f"{program}.json").write_text(text)

    def write_all(self):
        self.write("bench_floor", repetition("load/KiB:4", 0.001), repetition("load/KiB:262144", 0.1))
        self.write("bench_frame_cost", *(repetition("frame/adaptive/empty", n, p50_ns=1e3 * n, p99_ns=5e3, p999_ns=6e3,
                                                    max_ns=7e3) for n in (2.0, 1.0, 4.0)))

    def test_repetitions_become_median_least_and_most(self):
        self.write_all()
        done = run("bench_page.py", self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        table = (self.folder / "results.csv").read_text()
        self.assertIn("frame/adaptive/empty,time,ns,3,2000,1000,4000\n", table)
        self.assertEqual(run("bench_compare.py", *2 * [self.folder / "results.csv"]).returncode, 0)

    def test_two_runs_of_one_name_are_two_runs(self):
        # Without the right to SCHED_FIFO bench_jitter has each of its rows twice.
        self.write_all()
        late = [{"method": "paper", "scheduler": "SCHED_OTHER", "machine": "quiet", "late_p50_us": n} for n in (10.0, 90.0)]
        (self.folder / "bench_jitter.json").write_text(json.dumps(late))
        done = run("bench_page.py", self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("jitter/paper/SCHED_OTHER/quiet,late_p50_us,us,2,50,10,90\n", (self.folder / "results.csv").read_text())

    def test_a_time_that_rounds_to_the_next_unit_has_that(self):
        self.write("bench_floor", repetition("load/KiB:4", 0.001), repetition("load/KiB:262144", 0.1))
        self.write("bench_frame_cost", repetition("frame/adaptive/empty", 1.0, p50_ns=999.7, p99_ns=999.4, p999_ns=999600.0,
                                                  max_ns=2e6))
        run("bench_page.py", self.folder)
        page = (self.folder / "index.html").read_text()
        self.assertIn("<td>1 us</td><td>999 ns</td><td>1 ms</td><td>2 ms</td>", page)
        self.assertNotIn("1e+03", page)

    def test_the_page_needs_no_other_file(self):
        self.write_all()
        run("bench_page.py", self.folder)
        page = (self.folder / "index.html").read_text()
        self.assertEqual(re.findall(r'(?:src|href)=|url\(|@import', page), [])
        self.assertIn("<td>2 us</td><td>5 us</td><td>6 us</td><td>7 us</td>", page)
        self.assertIn("<td>2,000</td>", page)  # times the floor: 2 us by 1 ns

    def test_a_wrong_answer_fails_and_one_that_is_left_out_does_not(self):
        self.write_all()
        self.write("bench_a", dict(repetition("x", 0.0), error_occurred=True, error_message="left out: no data"))
        self.assertEqual(run("bench_page.py", self.folder).returncode, 0)
        self.write("bench_b", dict(repetition("y", 0.0), error_occurred=True, error_message="it is wrong"))
        done = run("bench_page.py", self.folder)
        self.assertEqual(done.returncode, 1)
        self.assertIn("b/y: a wrong answer", done.stderr)

    def test_without_results_it_says_what_to_do(self):
        done = run("bench_page.py", self.folder)
        self.assertEqual((done.returncode, done.stderr),
                         (3, f"bench_page.py: {self.folder}: no results in JSON; run ./palpate.sh bench\n"))


if __name__ == "__main__":
    unittest.main()
