"""What users ran into: the input, what it did, what happens now, and the test that shows it.

The table says where each fault is tested; the tests that it names do the work. What hostile scenes
did stands in the tables of ``test_hostile_input.py`` and in the files of ``hostile_scenes``.
"""

from __future__ import annotations

import ast
import functools
from pathlib import Path
from typing import NamedTuple

import pytest

TESTS = Path(__file__).parents[1]


class Fault(NamedTuple):
    """A fault that was reported, and where its end is tested (file and function)."""

    given: str
    did: str
    now: str
    file: str
    function: str


FAULTS = (
    # ---- a scene is data ----------------------------------------------------------------------
    Fault(
        "[petsc] start_in_debugger, dll_append, python types, viewers, logs, options files",
        "ran commands and files, loaded libraries, overwrote files, showed /etc/passwd",
        "refused: a closed list of bounded solver options; all else after -- only",
        "regression/test_hostile_input.py",
        "test_a_scene_gives_petsc_no_option_that_acts_on_files_or_programs",
    ),
    Fault(
        "the same in the config of a run.h5 that restart reads",
        "was handed to PETSc",
        "judged as the scene of a file is",
        "regression/test_hostile_input.py",
        "test_the_scene_of_a_result_file_is_judged_like_any_other",
    ),
    Fault(
        "a .petscrc beside a downloaded case",
        "gave PETSc any option",
        "not read",
        "regression/test_hostile_input.py",
        "test_options_files_beside_a_case_are_not_read",
    ),
    Fault(
        "study.py beside a case",
        "ran without being named",
        "runs with --study only, after a line that names it",
        "regression/test_hostile_input.py",
        "test_a_program_beside_a_case_runs_only_with_study_and_is_named_before",
    ),
    Fault(
        "NUL, escape sequences and other control characters in names, titles and keys",
        "check found the scene sound; run ended in a traceback, the old run.h5 gone",
        "one sentence that shows them escaped",
        "regression/test_hostile_input.py",
        "test_what_was_reported_ends_in_one_sentence",
    ),
    Fault(
        "run --force on a scene that fails after set-up",
        "the earlier result was gone",
        "it stays until the first step of the new run is on the disk",
        "unit/postproc/test_postproc_file_life.py",
        "test_an_earlier_file_stays_until_the_first_step_is_written",
    ),
    Fault(
        "a byte order mark",
        "Invalid statement (at line 1, column 1)",
        "taken",
        "regression/test_hostile_input.py",
        "test_a_byte_order_mark_is_taken",
    ),
    Fault(
        "24 million nodes",
        "minutes without a word",
        "counted before the mesh is made; refused beyond 4 million",
        "regression/test_hostile_input.py",
        "test_a_mesh_is_counted_before_it_is_made",
    ),
    Fault(
        "a variant called =HYPERLINK(...)",
        "a formula in the spreadsheet",
        "refused; other cells of CSV files get an apostrophe",
        "regression/test_hostile_input.py",
        "test_a_variant_is_not_named_like_a_formula",
    ),
    Fault(
        "a hundred hostile scene files through check, plan and run",
        "tracebacks, hangs, files",
        "one sentence each, code 2, nothing written or run",
        "regression/test_hostile_scenes.py",
        "test_a_hostile_scene_is_refused",
    ),
    # ---- machines as users have them ----------------------------------------------------------
    Fault(
        "Debian's paraview or python3-matplotlib beside the program",
        "two lines of warning at every verb, no test collected",
        "the environment sees five packages of the system and no others",
        "unit/test_environment.py",
        "test_packages_come_from_the_environment_only",
    ),
    Fault(
        "set-up in a year",
        "whatever is newest then",
        "the versions that were tested together",
        "unit/test_environment.py",
        "test_tested_versions_are_within_the_bounds",
    ),
    Fault(
        "run --force and restart onto a live run",
        "both destroyed",
        "refused with process, machine and age of its last sign of life",
        "regression/test_locked_folder.py",
        "test_a_live_run_is_left_alone_and_can_be_looked_at",
    ),
    Fault(
        "a lock that a dead process has left",
        "(there were no locks)",
        "taken over",
        "unit/test_result_folders.py",
        "test_a_lock_of_a_dead_process_is_taken_over",
    ),
    Fault(
        "neither HOME nor the installation can be written",
        "a traceback of the compiler of loops",
        "the run, with nothing to compile",
        "unit/test_result_folders.py",
        "test_a_user_without_home_and_without_write_access",
    ),
    Fault(
        "one bit flipped in a result file",
        "tracebacks, hangs, other numbers without a word",
        "checksums; a sentence, or what is sound is used and the rest told",
        "regression/test_fuzz_damage.py",
        "test_a_flipped_bit_is_told_or_changes_nothing",
    ),
    Fault(
        "a crash or an endless loop inside HDF5",
        "an eternal hang that Ctrl-C does not end",
        "a sentence: files are examined in a process of its own",
        "regression/test_fuzz_damage.py",
        "test_a_crash_and_an_endless_loop_of_hdf5_end_in_a_sentence",
    ),
    Fault(
        "missing or odd attributes, datasets and checkpoints",
        "KeyError, JSONDecodeError, ZeroDivisionError",
        "one sentence",
        "unit/postproc/test_postproc_damage.py",
        "test_random_damage_is_told_in_a_sentence",
    ),
    Fault(
        "edition 2099, a state with NaN, complete_rows of 0",
        "computed, ended in a traceback or as done",
        "refused before a restart computes",
        "regression/test_fuzz_damage.py",
        "test_what_cannot_be_is_not_continued",
    ),
    Fault(
        "SIGTERM, SIGHUP, SIGUSR1 before the march",
        "died without a word",
        "a sentence that names signal and phase; nothing is written",
        "regression/test_signals.py",
        "test_before_the_march",
    ),
    Fault(
        "the same after the march",
        "died without a word",
        "a sentence: the results are complete, report writes the rest",
        "regression/test_signals.py",
        "test_after_the_march",
    ),
    Fault(
        "the same to one of several ranks",
        "the others waited",
        "all end",
        "regression/test_signals.py",
        "test_a_signal_to_one_of_several_ranks",
    ),
    Fault(
        "summary, report and pictures of an earlier run under --force",
        "stayed beside a new, half-done run.h5",
        "removed once the new run has begun; a user's own files stay",
        "unit/postproc/test_postproc_file_life.py",
        "test_what_is_stale_goes_and_what_is_a_users_stays",
    ),
    Fault(
        "a file of the user's moved onto run.h5 during the run",
        "enlarged by 56 MB of zeros",
        "untouched; the run ends and says so",
        "unit/postproc/test_postproc_file_life.py",
        "test_a_file_that_is_taken_away_ends_the_run",
    ),
    Fault(
        "run.h5 as a link",
        "followed and overwritten",
        "the link is replaced",
        "unit/postproc/test_postproc_file_life.py",
        "test_a_link_is_replaced_and_not_followed",
    ),
    Fault(
        "report on a full or read-only disk",
        "traceback",
        "a sentence in the system's true words",
        "unit/postproc/test_postproc_file_life.py",
        "test_a_report_that_cannot_be_written_is_a_sentence",
    ),
    Fault(
        "the report of a long run",
        "23.7 GB of memory",
        "read by blocks",
        "unit/postproc/test_block_reading.py",
        "test_a_report_on_a_long_run_takes_bounded_memory",
    ),
    Fault(
        "2000 spans for 240 s",
        "17 GB of run.h5",
        "a window around the train and a cadence beyond 500 MB; extremes of every step",
        "unit/test_file_sizes.py",
        "test_long_lines_are_thinned_by_their_size",
    ),
    Fault(
        "plan of a short run",
        "a tenth of the size of its files",
        "within a few per cent",
        "unit/test_file_sizes.py",
        "test_the_plan_tells_the_sizes_of_the_files",
    ),
    # ---- silent nonsense ----------------------------------------------------------------------
    Fault(
        "en50318_2002 on 12 spans",
        "46 N off in the force history, without a word",
        "a warning with the number of spans that would do",
        "unit/test_wave_arrivals.py",
        "test_what_a_warning_advises_ends_it",
    ),
    Fault(
        "where reflected waves meet a pantograph",
        "not told",
        "predicted to within some metres of where marches change",
        "verification/test_wave_arrivals_in_a_march.py",
        "test_the_force_changes_where_the_wave_is_met",
    ),
    Fault(
        "a newcomer's first run of each shipped case",
        "a warning about the shipped mesh",
        "none",
        "regression/test_case_claims.py",
        "test_a_shipped_case_ends_without_a_warning",
    ),
    Fault(
        "accuracy: errors of step and mesh that cancel",
        "recommended",
        "measured apart; both must keep the target",
        "unit/test_accuracy_analysis.py",
        "test_errors_of_step_and_mesh_that_cancel_are_no_reason",
    ),
    Fault(
        "accuracy: a reference with the mesh that is judged, or an uncertain one",
        "recommended",
        "finer in both; no recommendation if it is uncertain by a third of the target",
        "unit/test_accuracy_analysis.py",
        "test_an_uncertain_reference_recommends_nothing",
    ),
    Fault(
        "sweep of a line that fails",
        "passed: false",
        "the criteria that failed, by name",
        "unit/test_sweep.py",
        "test_what_failed_is_told_by_name",
    ),
    Fault(
        "compare of equal runs; one rank",
        "-0.0000; 1 ranks",
        "0.0000; 1 rank",
        "unit/postproc/test_wording.py",
        "test_zero_has_no_sign",
    ),
    # ---- errors -------------------------------------------------------------------------------
    Fault(
        "-o with too long a name, below /proc, through a looped link",
        "a traceback, or free some space after set-up",
        "refused before anything is computed",
        "unit/test_result_folders.py",
        "test_a_folder_that_cannot_be_is_refused_in_true_words",
    ),
    Fault(
        "230 GB of results, 8 million steps",
        "begun without a word",
        "size and hours are told, --force is asked for",
        "unit/test_result_folders.py",
        "test_a_very_large_run_asks_for_force",
    ),
    Fault(
        "a verb, an option or an argument that is not there",
        "three lines of usage",
        "one sentence",
        "regression/test_hostile_input.py",
        "test_a_usage_error_is_one_sentence",
    ),
    Fault(
        "ac_simple",
        "FAILED mean contact force: 143.36, limit 143.36",
        "keeps the limit; figures are printed to where they differ",
        "unit/postproc/test_wording.py",
        "test_a_summary_shows_by_how_little_a_limit_is_missed",
    ),
    Fault(
        "EN 50318 in other spans than 7 to 10",
        "every row holds",
        "a table of spans and meshes, kept true",
        "regression/test_case_claims.py",
        "test_the_windows_of_en50318_miss_what_its_readme_says",
    ),
    # ---- the paper's law ----------------------------------------------------------------------
    Fault(
        "equation (2.7) as it is printed",
        "could not be chosen",
        "line.dropper.slack_damping = kept; an independent program's deviations within 1 %",
        "regression/test_printed_law.py",
        "test_the_printed_law_gives_what_an_independent_program_gives",
    ),
    # ---- speaking with people -----------------------------------------------------------------
    Fault(
        "check of a scene with four faults",
        "one of them, and 3 more problems",
        "all, each with its key",
        "regression/test_hostile_input.py",
        "test_check_tells_every_fault_of_the_tables_with_its_key",
    ),
    Fault(
        "list --keys damping; catenary --version",
        "usage errors",
        "bounds, words and typical values; versions of the libraries",
        "unit/test_key_list.py",
        "test_damping_and_bending_stiffness_have_typical_values",
    ),
    Fault(
        "a misspelt key",
        "3 to 4 s, because everything was imported",
        "no numerical library is loaded for it",
        "unit/test_cli_imports.py",
        "test_no_backend_is_loaded_for_an_answer_or_a_refusal",
    ),
    Fault(
        "a run whose log goes to a file",
        "nothing until its end",
        "a line every ten seconds",
        "unit/postproc/test_postproc_progress.py",
        "test_a_log_gets_a_line_every_ten_seconds",
    ),
    Fault(
        "outputs in README and docs",
        "stale",
        "run and compared",
        "regression/test_documents.py",
        "test_what_is_shown_is_what_happens",
    ),
    # ---- runs that ran away -------------------------------------------------------------------
    Fault(
        "windy_viaduct in a storm of 65 m/s: the wire stands beside the strips at rest",
        "out of reach there, the head came back with 5 kN: standard deviation 409 N",
        "contact goes on beside the strips, is told and judged",
        "regression/test_storm.py",
        "test_contact_goes_on_beside_the_strips_and_is_told",
    ),
    Fault(
        "the same at 80 m/s, where blows of the head lifted pushed arms until they folded over",
        "done, exit code 0: an uplift of 1.5e10 mm, an energy of -1.2e19 J",
        "bounded, 0.18 m; motion beyond linear theory is told and ends a run with exit code 1",
        "verification/test_run_watch.py",
        "test_motion_beyond_linear_theory_is_told_and_ends_a_march",
    ),
    Fault(
        "a rest with arms that are pushed so far that it is unstable",
        "was marched from",
        "refused with arm, force and place",
        "regression/test_storm.py",
        "test_arms_that_are_pushed_so_far_that_they_fold_are_refused",
    ),
    Fault(
        "en50318_2002 without damping, droppers of 1e6 N/m at 3 ms",
        "done with 724 kJ in the line and a standard deviation of 190 N",
        "numerical damping of stiff droppers: no energy is made",
        "verification/test_run_watch.py",
        "test_stiff_droppers_make_no_energy_with_numerical_damping",
    ),
    Fault(
        "the same with effects.stiff_link_damping=false",
        "done",
        "told, then ended with exit code 1 once the scheme has made more than the contacts",
        "verification/test_run_watch.py",
        "test_energy_from_nothing_is_told_and_ends_a_march",
    ),
    Fault(
        "a contact force that is zero all the way",
        "passed mean contact force: 0.00",
        "not judged, with a sentence",
        "unit/postproc/test_postproc_standards.py",
        "test_nothing_of_a_pantograph_passes_by_statistics_that_judge_nothing",
    ),
    Fault(
        "a pantograph that loses the wire for good",
        "done without a word",
        "told after a span, and at the end",
        "verification/test_run_watch.py",
        "test_a_contact_that_is_lost_for_good_is_told",
    ),
    Fault(
        "what decides a result numerically (1e8 N/m contact, 1e9 N/m droppers)",
        "stood in report.html alone",
        "remarks in summary.json, terminal, sweep.csv, compare",
        "regression/test_reported_remarks.py",
        "test_remarks_are_told_wherever_results_are",
    ),
    Fault(
        "random scenes at the bounds of the schema",
        "ran away without a word",
        "end, tell, or are alike with a quarter of the step",
        "regression/test_fuzz_stability.py",
        "test_nothing_runs_away_without_a_word",
        # Conductor rails and the pantographs under them
    ),
    Fault(
        "a conductor rail, 120 km/h",
        "refused and judged by sqrt(T / m), 13.5 km/h",
        "by the slowest wave of the beam on its supports, 238 km/h",
        "verification/test_slowest_wave.py",
        "test_the_rail_has_the_slowest_wave_of_its_pass_bands",
    ),
    Fault(
        "waves ahead of the train on a conductor rail",
        "the train is as fast as the waves, which no mesh resolves",
        "the wavenumber of bending waves",
        "unit/postproc/test_postproc_remarks.py",
        "test_waves_ahead_on_a_rail_are_shortened_by_its_bending",
    ),
    Fault(
        "a chain of masses on a stiff base spring",
        "started 18 mm below its base: 745 N at once, 51 N of deviation, losses of contact",
        "its base is raised with the lift",
        "verification/test_tied_pantograph.py",
        "test_the_force_under_a_rail_is_that_of_a_plain_model",
    ),
    Fault(
        "the static force of a chain on a stiff base spring",
        "7 N less on average: the depth of the contact was left out",
        "counted; check and pantograph say that the force depends on the height",
        "unit/mbs/test_multibody_standing.py",
        "test_a_tied_chain_says_by_how_much_its_force_depends_on_the_height",
    ),
    # ---- wind, lateral damping, lengths of droppers ---------------------------------------------
    Fault(
        "windy_viaduct: 0.00097 u^2 of the train's own flow in a wind across the track",
        "the mean force grew from 141 to 151 N",
        "pantographs.NAME.crosswind_factor, 0 by default and told; 141 N",
        "unit/mbs/test_air.py",
        "test_wind_adds_to_the_speed_of_the_train_as_far_as_it_counts",
    ),
    Fault(
        "what a cross wind does to pantographs, in plan and report",
        "was not said",
        "told beside each pantograph in a wind",
        "unit/test_scene_incidents.py",
        "test_what_a_cross_wind_counts_is_told_beside_the_pantograph",
    ),
    Fault(
        "ac_simple_3d: the damping of lateral motion",
        "decided on 4 N of sigma without a key or a source",
        "line.damping.lateral; the band of measurements moves sigma by 1 N",
        "unit/solver/test_planes_counting.py",
        "test_wires_have_a_damping_of_their_own_across_the_track",
    ),
    Fault(
        "catenary accuracy of a line with lateral motion",
        "no axis showed what its damping decides",
        "axis lateral_damping",
        "unit/test_accuracy_analysis.py",
        "test_lateral_motion_is_damped_over_the_band_of_measurements",
    ),
    Fault(
        "dropper lengths of ac_simple with 8 to 64 elements a gap",
        "1.0163 to 1.0155 m, printed with four decimals",
        "1.0155 m on every mesh",
        "verification/test_static_shape.py",
        "test_droppers_are_cut_to_the_same_lengths_on_every_mesh",
    ),
    Fault(
        "droppers of 0.117 kg/m that 196 N stretch by 2 mm",
        "weighed by their stretched length",
        "weigh by the length as cut",
        "verification/test_static_shape.py",
        "test_bending_stiffness_rounds_the_kinks_but_keeps_the_weights",
    ),
    Fault(
        "wind.speed_m_per_s=0 as a variant of a sweep",
        "was refused",
        "a calm",
        "unit/test_scene_incidents.py",
        "test_a_calm_has_no_wind_and_no_gusts",
    ),
    Fault(
        "reference/expected.csv of four cases",
        "made on other meshes than the cases'",
        "made by a second program on equal inputs",
        "verification/test_second_program.py",
        "test_expected_figures_are_those_of_the_second_program",
    ),
    # ---- other programs, other systems --------------------------------------------------------
    Fault(
        "a matplotlibrc with text.usetex, or a dark style, in the working directory",
        "a traceback after the march, and no summary.json; pictures without a curve",
        "pictures in the program's own style",
        "unit/postproc/test_figures.py",
        "test_a_users_settings_change_no_picture_and_stay_the_users",
    ),
    Fault(
        "a matplotlibrc that is no text",
        "a traceback of sweep, waves, mesh and others; a report without pictures",
        "is not read",
        "unit/postproc/test_figures.py",
        "test_a_matplotlibrc_that_cannot_be_read_changes_no_picture",
    ),
    Fault(
        "a picture that cannot be drawn",
        "cost the summary",
        "is left out with a warning; the summary is written before",
        "unit/postproc/test_figures.py",
        "test_a_picture_that_cannot_be_drawn_costs_itself_alone",
    ),
    Fault(
        "-- -march_ksp_typ gmres; the same in PETSC_OPTIONS",
        "passed without a word",
        "a warning at the end, with the nearest name",
        "regression/test_petsc_options.py",
        "test_misspelt_options_are_told_with_the_nearest_name",
    ),
    Fault(
        "results on a file system without locks",
        "No locks available: choose another output folder",
        "written without HDF5's lock",
        "unit/postproc/test_postproc_recorder.py",
        "test_a_file_system_without_locks_is_written_to",
    ),
    Fault(
        "srun with 3 tasks that MPI sees as one rank each",
        "each ran alone without a word",
        "the first one says so",
        "unit/test_batch_tasks.py",
        "test_single_processes_of_several_tasks_are_told",
    ),
    Fault(
        "run.h5 in xarray",
        "phony_dim_0 to phony_dim_37, no units",
        "time, places and units",
        "unit/postproc/test_dimensions.py",
        "test_each_dimension_of_each_table_has_one_name",
    ),
    Fault(
        "sweep with one implausible value",
        "refused as a whole, with no way to insist",
        "breaks alone; case.accept_unusual",
        "unit/test_sweep.py",
        "test_a_variant_that_is_refused_breaks_alone",
    ),
    Fault(
        "numbers of sweep.csv",
        "six digits",
        "all of them",
        "unit/test_sweep.py",
        "test_each_variant_has_its_run_and_a_row",
    ),
    Fault(
        "a dropper that is pushed by 0.04 N at rest; zeros in tables",
        "-0.0 N; -0",
        "-0.04 N; 0",
        "unit/postproc/test_wording.py",
        "test_zero_in_a_cell_has_no_sign",
    ),
    # ---- what a user sees and waits for -------------------------------------------------------
    Fault(
        "make setup in a fresh clone",
        "up to 90 s without a word",
        "each step, how long it takes and took",
        "unit/test_environment.py",
        "test_setup_says_what_it_does_and_for_how_long",
    ),
    Fault(
        "a run's real-time factor",
        "that of the steps, without what is recorded after them",
        "both, and the time of the whole command by phases",
        "unit/postproc/test_wording.py",
        "test_a_summary_shows_by_how_little_a_limit_is_missed",
    ),
    Fault(
        "a report on paper",
        "US Letter, tables cut off",
        "A4, whole tables",
        "unit/postproc/test_postproc_report.py",
        "test_pages_are_printed_on_a4",
    ),
    Fault(
        "a picture that names four wires",
        "its legend lay over its title",
        "the title stands above, the panel keeps its height",
        "unit/postproc/test_figures.py",
        "test_a_long_legend_stands_below_the_title",
    ),
    Fault(
        "a report on a stretch with an overlap",
        "droppers and profile of a span with the wires of both sections",
        "of the nearest span outside",
        "unit/postproc/test_line_record.py",
        "test_the_span_that_is_shown_has_the_usual_wires",
    ),
    Fault(
        "tables of twin wires",
        "two rows of one support, no wire's name",
        "the wire of each arm and dropper",
        "unit/postproc/test_line_record.py",
        "test_arms_and_droppers_of_several_wires_are_named",
    ),
    Fault(
        "a file of 401 lines, a folder of 14 files",
        "failed the tests, whatever was in them",
        "no bound on either",
        "unit/test_layers.py",
        "test_files_import_only_rooms_below_their_own",
    ),
    Fault(
        "window.mode = bounded on 1000 spans",
        "snapshots of all spans, 980 of them at rest: 508 MB, 2.5 times the march of 40 spans",
        "the spans that move: 46 MB, 1.2 times",
        "regression/test_windowed_records.py",
        "test_snapshots_show_what_moves",
    ),
    # ---- a result file is data ----------------------------------------------------------------
    Fault(
        "a state in run.h5 whose numbers lie in a file of the user",
        "restart overwrote that file",
        "refused with the name of the table; both files stay as they are",
        "regression/test_hostile_results.py",
        "test_a_state_in_a_file_of_the_user_is_not_written",
    ),
    Fault(
        "soft and external links, virtual tables, tables larger than the file",
        "were followed, or ended in tracebacks",
        "refused wherever run.h5 or fields.h5 is opened",
        "unit/postproc/test_self_contained.py",
        "test_a_file_that_names_another_one_is_refused",
    ),
    Fault(
        "a run.h5 that is a symbolic link",
        "was followed, and continued where it led",
        "refused by all verbs",
        "regression/test_hostile_results.py",
        "test_a_result_file_that_is_a_link_is_not_followed",
    ),
    Fault(
        "a link named paraview, or links in that folder",
        "were written through",
        "the folder is refused, files are replaced",
        "regression/test_hostile_results.py",
        "test_nothing_is_written_through_links_of_a_folder_for_paraview",
    ),
    Fault(
        "escape sequences in the outcome of a result file",
        "compare printed them",
        "printed as escapes",
        "regression/test_hostile_results.py",
        "test_words_of_a_file_do_not_steer_the_terminal",
    ),
    Fault(
        "a pipe named .catenary.lock",
        "restart waited for ever",
        "refused in a sentence",
        "unit/test_result_folders.py",
        "test_what_is_no_lock_is_neither_read_nor_followed",
    ),
    Fault(
        "first below 0, nodes outside the line, a block twice, deep brackets, times of 1e9 rows",
        "tracebacks, or a minute and a lack of memory",
        "one sentence that names the table",
        "unit/postproc/test_fields_schema.py",
        "test_damage_is_told_in_a_sentence",
    ),
    Fault(
        "complete_rows of 1e15",
        "restart ended in a traceback",
        "the length of the tables counts",
        "regression/test_fuzz_damage.py",
        "test_counts_of_rows_that_cannot_be_are_replaced",
    ),
    Fault(
        "waves --excite hammer --impulse-Ns 1e300",
        "broke after half a minute",
        "refused at once; 1e9 N at most",
        "unit/test_excitation.py",
        "test_what_is_impossible_is_refused_in_a_sentence",
    ),
    Fault(
        "plan > /dev/full",
        "a traceback",
        "one sentence, exit code 1",
        "unit/test_cli_verbs.py",
        "test_an_output_that_cannot_be_written_is_told",
    ),
    Fault(
        "2>&-",
        "a traceback; texts of libraries could go into a result file",
        "closed streams lead nowhere",
        "unit/test_cli_verbs.py",
        "test_streams_that_are_closed_lead_nowhere",
    ),
    Fault(
        "a state with a right checksum and a reversed row_of_node",
        "restarted to 2302 N in place of 250 N",
        "refused: node 0 is in another row along this line",
        "unit/solver/test_march_endings.py",
        "test_a_state_of_another_line_is_refused",
    ),
    Fault(
        "a state with a right checksum and another motion or force",
        "was continued",
        "refused: it does not belong to the records of its step",
        "regression/test_fuzz_damage.py",
        "test_what_cannot_be_is_not_continued",
    ),
    Fault(
        "a run stopped in its first step, snapshots more than a hundred steps apart",
        "lost its first snapshot when it was continued",
        "keeps it",
        "unit/postproc/test_postproc_fields.py",
        "test_no_snapshot_before_the_state_is_lost",
    ),
)


@functools.cache
def functions_of(file: str) -> set[str]:
    """Names of the tests of a file."""
    tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.given[:60])
def test_a_fault_that_was_reported_has_its_test(fault: Fault) -> None:
    assert fault.function in functions_of(fault.file)
