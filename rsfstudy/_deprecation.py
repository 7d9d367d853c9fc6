"""Former names of public functions, classes, members and keywords.

A former name works for one release and emits a ``DeprecationWarning`` that contains the new name.
The former names will be removed in version 1.0.0. The dictionary
``NEW_NAME_BY_OWNER_AND_FORMER_NAME`` maps former names to new names. The keys of
``NEW_NAME_BY_OWNER_AND_FORMER_NAME`` have three forms:

``"package.module"``
    Names in a module. The module sets ``__getattr__ = build_getattr_for_former_names(__name__)``.
``"package.module:Class"``
    Members of a class with the decorator ``add_former_member_names``. If user-defined subclasses
    may override the members, the ``__init_subclass__`` method of the class calls
    ``copy_former_overrides_to_new_names``.
``"package.module:function()"``, ``"package.module:Class()"``
    Keyword arguments of a function or of a constructor. The outermost decorator of the function or
    class is ``accept_former_keyword_names``.
"""

from __future__ import annotations

import functools
import importlib
import operator
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

DecoratedFunction = TypeVar("DecoratedFunction", bound=Callable[..., Any])
DecoratedClass = TypeVar("DecoratedClass", bound=type)

#: Mapping from former names to new names, for each module, class, function or constructor.
NEW_NAME_BY_OWNER_AND_FORMER_NAME: Mapping[str, Mapping[str, str]] = {
    "rsfstudy": {
        "Laboratory": "Rig",
        "picture": "plot_motion",
        "cell": "recompute_cell",
    },
    "rsfstudy.motion": {
        "adapt_former_compute": "accept_deprecated_accuracy_and_meter",
        "DEFAULT_RTOL": "Accuracy.DEFAULT_RTOL",
        "MIN_RTOL": "Accuracy.MIN_RTOL",
        "MAX_RTOL": "Accuracy.MAX_RTOL",
        "DEFAULT_EVALUATION_BUDGET": "Accuracy.DEFAULT_BUDGET",
        "MAX_ERROR_OVER_RTOL": "Accuracy.MAX_RELIABLE_ERROR_OVER_RTOL",
        "RELATIVE_ROUNDING_ERROR": "Accuracy.RELATIVE_ROUNDING_ERROR",
        "MIN_LOCAL_TOLERANCE": "Integrator.MIN_LOCAL_ERROR_TOLERANCE",
        "SCIPY": "Engine.SCIPY",
        "PYTHON": "Engine.PYTHON",
        "COMPILED": "Engine.COMPILED",
        "ENGINES": "Engine.NAMES",
        "compilation_log": "Engine.compilation_log",
        "is_engine_installed": "Engine.is_installed",
        "check_engine_is_usable": "Engine.check_is_usable",
        "import_compiled_engine": "Engine.import_compiled_engine",
        "find_user_stepper": "Engine.find_user_stepper",
        "register_user_steppers": "Engine.register_user_steppers",
        "RECORDED_VARIABLES": "MotionRecorder.RECORDED_VARIABLE_NAMES",
        "MOTION_VARIABLES": "MotionRecorder.MOTION_VARIABLE_NAMES",
        "REGIME_COLUMN": "MotionRecorder.REGIME_COLUMN_INDEX",
        "SAMPLE_COLUMN": "MotionRecorder.SAMPLE_NUMBER_COLUMN_INDEX",
        "FIRST_STATE_COLUMN": "MotionRecorder.FIRST_STATE_COLUMN_INDEX",
        "recorded_row": "MotionRecorder.convert_point_to_row",
        "recorded_friction_coefficient": "MotionRecorder.get_friction_coefficient",
        "recorded_load_point_displacement": "MotionRecorder.compute_load_point_displacement",
        "initial_point": "Integrator.compute_initial_point",
        "point_before_start": "Integrator.compute_point_before_start",
        "compute_restart_point": "Integrator.compute_restart_point",
        "point_with_slip_rate": "Integrator.compute_point_with_slip_rate",
    },
    "rsfstudy.slider": {
        "build_sampled_history": "SampledHistory.from_samples",
        "build_sampled_history_from_table": "SampledHistory.from_table",
        "LARGEST_LOG_SLIP_RATE": "Scene.LOG_SLIP_RATE_UPPER_LIMIT",
        "STOPPED_LOG_SLIP_RATE": "Scene.LOG_SLIP_RATE_OF_STOPPED_SLIP",
        "RUPTURE_REGIME": "Scene.RUPTURE_REGIME",
        "OMITTED_DEFAULTS": "SceneFields.DEFAULTS_OMITTED_FROM_STORED_SCENES",
        "SLOTS": "SceneFields.PART_SLOTS",
        "field_names": "SceneFields.list_part_field_names",
        "scene_field_types": "SceneFields.map_field_names_to_value_types",
        "normalise_field_value": "SceneFields.replace_part_or_alias_by_part_name",
        "replace_names_by_user_parts": "SceneFields.replace_names_by_user_parts",
        "SCENE_FIELD_NAMES": "SceneFields.NAMES",
        "SCENE_FIELD_QUANTITIES": "SceneFields.QUANTITIES",
        "SCENE_FIELD_TYPES": "SceneFields.VALUE_TYPE_BY_NAME",
        "SLOT_NAMES": "SceneFields.PART_SLOT_NAMES",
        "PART_SELECTING_FIELDS": "SceneFields.PART_SELECTING_FIELD_NAMES",
        "ALTERNATIVE_STIFFNESS_FIELDS": "SceneFields.ALTERNATIVE_NAMES_FOR_STIFFNESS",
        "scene_field_defaults": "SceneFields.map_field_names_to_defaults",
        "scene_field_quantities": "SceneFields.map_field_names_to_quantities",
        "quantities_with_values": "SceneFields.iterate_quantities_with_values",
        "add_scene_fields_to_signature": "SceneFields.add_fields_to_signature",
        "find_inapplicable_fields": "SceneFields.find_inapplicable_fields",
        "hint_for_unknown_field": "SceneFields.build_hint_for_unknown_field",
        "register_user_parts": "SceneFields.register_user_parts",
        "equations_between_ruptures": "Scene.equations_between_ruptures",
        "equations_in_rupture": "Scene.equations_in_rupture",
        "equations_without_mass": "Scene.equations_without_mass",
        "equations_at_imposed_slip_rate": "Scene.equations_at_imposed_slip_rate",
        "build_equations_against_displacement": "Scene.equations_against_displacement",
        "build_equations_against_inertial_time": "Scene.equations_against_inertial_time",
        "quasi_static_log_slip_rate": "Scene.compute_quasi_static_log_slip_rate",
        "build_friction_relation": "Scene.build_friction_relation",
        "build_state_evolution_function": "Scene.build_state_evolution_function",
        "compute_steady_states": "Scene.compute_steady_states",
        "effective_normal_stress_at": "Scene.compute_effective_normal_stress",
        "steady_sliding": "Scene.compute_steady_sliding",
        "steady_friction_minus_reference": "Scene.steady_friction_minus_reference",
        "frictional_stress_after_jump": "Scene.frictional_stress_from_strength",
        "frictional_stress_for_friction": "Scene.frictional_stress_from_friction",
        "min_steady_log_slip_rate": "Scene.find_min_steady_log_slip_rate",
        "critical_stiffness": "Scene.critical_stiffness_at",
        "all_critical_stiffnesses": "Scene.compute_all_critical_stiffnesses",
        "linear_growth_rates": "Scene.linear_growth_rates",
        "largest_linear_growth_rate": "Scene.compute_largest_linear_growth_rate",
    },
    "rsfstudy.rig": {
        "RIG_QUANTITIES": "Rig.QUANTITIES",
        "in_display_units": "Rig.convert_quantities_for_display",
        "is_stiffness_over_normal_stress": "Rig.is_stiffness_in_friction_per_length",
        "DIMENSIONLESS_PREFIX": "DatasetUnits.DIMENSIONLESS_FIELD_NAME_PREFIX",
        "DISPLAY_BASE_UNITS": "DatasetUnits.DISPLAY_UNITS",
        "NAME_OF_SCALES_ATTRIBUTE": "DatasetUnits.UNIT_SCALES_ATTRIBUTE_NAME",
        "convert_to_dimensional_name": "DatasetUnits.convert_to_dimensional_variable_name",
        "RATIO_FIELD_BY_DIMENSIONAL_NAME": "RigAxes.RATIO_FIELD_BY_DIMENSIONAL_NAME",
        "make_axis_with_units": "RigAxes.create_axis",
        "axis_name_and_units": "RigAxes.find_axis_name_and_si_units",
        "convert_values_to_units": "RigAxes.convert_values_to_units",
        "convert_axis_to_stated_units": "RigAxes.convert_axis_values_to_axis_units",
        "replace_rig_quantity": "RigAxes.replace_rig_quantity",
        "convert_scene_and_axes_to_rig": "RigAxes.convert_scene_and_axes_to_rig_units",
    },
    "rsfstudy.limit_cycles": {
        "SLIP_MODES": "LimitCycle.SLIP_MODE_NAMES",
    },
    "rsfstudy.critical_steps": {
        "SLOW_INSTABILITY_NORM_WARNING_PREFIX": "CriticalStep.SLOW_NORM_WARNING_PREFIX",
    },
    "rsfstudy.study": {
        "VERDICTS": "Claim.VERDICTS",
        "NOT_APPLICABLE_VERDICT": "Claim.NOT_APPLICABLE",
    },
    "rsfstudy.execution": {
        "estimate_evaluations_and_time": "CellPlan.estimate_evaluations_and_time",
    },
    "rsfstudy.storage": {
        "read_timings": "CellWallTimes.read_from_journal",
    },
    "rsfstudy.axes": {
        "fields_of_axis_point": "Axis.get_fields_of_point",
        "check_storable_text": "Axis.check_storable_text",
        "to_plain_value": "Axis.convert_to_plain_value",
    },
    "rsfstudy.errors": {
        "NoAnswer": "NoResultWarning",
        "Incomplete": "IncompleteWarning",
        "Signalled": "SignalInterrupt",
    },
    "rsfstudy.errors:InvalidValue": {
        "at": "with_location",
    },
    "rsfstudy.quantities": {
        "ShownAsTable": "HtmlTableMixin",
        "escape_html": "HtmlText.escape",
        "html_table": "HtmlText.format_table",
    },
    "rsfstudy.quantities:Output": {
        "names": "variable_names",
    },
    "rsfstudy.rig.rig": {
        "Laboratory": "Rig",
    },
    "rsfstudy.rig.rig:Rig": {
        "on_axis": "si_values_by_axis_name",
    },
    "rsfstudy.rig.protocol_files:history()": {
        "laboratory": "rig",
    },
    "rsfstudy.rig.protocol_files:read_protocol()": {
        "laboratory": "rig",
    },
    "rsfstudy.rig.table_files": {
        "Selected": "ColumnSelection",
    },
    "rsfstudy.rig.table_columns:Column": {
        "path": "file_path",
        "number": "one_based_column_number",
        "lines": "line_numbers",
        "place": "format_location_of_row",
        "check": "raise_for_invalid_values",
    },
    "rsfstudy.axes.axis:Axis()": {
        "drawn": "sampling_info",
    },
    "rsfstudy.axes.axis:Axis": {
        "drawn": "sampling_info",
        "is_plain": "varies_single_field",
        "is_numbered": "has_numbered_points",
        "points": "point_names",
    },
    "rsfstudy.study.study:Study()": {
        "laboratory": "rig",
        "declared_in": "source_file",
    },
    "rsfstudy.study.study:Study": {
        "laboratory": "rig",
        "declared_in": "source_file",
        "own_parts": "user_parts",
        "own_classes": "user_defined_classes",
        "of_scene": "scene_and_rig_field_names",
        "fields_of": "convert_row_to_scene_fields",
        "changes": "compute_cell_field_changes",
        "split": "split_scene_and_measure_fields",
        "place": "describe_cell",
    },
    "rsfstudy.study.claims:Claim": {
        "check_place": "check_applies_to_dataset",
        "minus": "baseline",
        "minus_variable": "baseline_variable",
        "because": "difference_reason",
    },
    "rsfstudy.study.claims:Claim()": {
        "minus": "baseline",
        "minus_variable": "baseline_variable",
        "because": "difference_reason",
    },
    "rsfstudy.study.reductions.fits:ProportionalFit": {
        "minus": "intercept",
    },
    "rsfstudy.study.reductions.fits:ProportionalFit()": {
        "minus": "intercept",
    },
    "rsfstudy.study.figure_declarations": {
        "level": "build_horizontal_line_overlay",
    },
    "rsfstudy.study.figure_declarations:Panel()": {
        "by": "hue",
        "each": "facet",
        "at": "isel",
        "points": "markers_only",
        "error": "error_bars",
        "through": "fit_line",
        "name": "curve_label",
        "says": "annotation",
        "marks": "overlays",
        "alike": "y_scale_group",
        "when": "condition",
        "columns": "legend_columns",
        "as_marked": "is_custom",
    },
    "rsfstudy.study.figure_declarations:Figure()": {
        "more_axes": "allow_extra_dims",
    },
    "rsfstudy.reductions": {
        "reduced": "apply_reductions",
        "OverClosedForm": "ClosedFormRatio",
        "DecadeFit": "SemilogFit",
    },
    "rsfstudy.study.reductions.base:Reduction": {
        "measured_in": "fields_determining_result_units",
        "unit_fields": "fields_determining_result_units",
        "of_failures": "uses_failed_cells",
        "draws_on": "get_status_of_used_cells",
    },
    "rsfstudy.plots": {
        "place": "describe_point",
        "name_rows": "label_rows",
        "look": "cycle_style",
        "marker": "cycle_marker",
        "in_grey": "add_grey_legend_entry",
        "styled": "style_context",
        "number": "format_number",
        "slope_with_error": "format_slope",
        "figure": "draw_figure",
        "save": "save_figure",
        "rendered": "render_figure",
        "NAMES": "FIGURE_NAMES",
        "Drawing": "NotebookFigure",
    },
    "rsfstudy.plots._motion:plot_motion()": {
        "laboratory": "rig",
    },
    "rsfstudy.api.accessor:DatasetAccessor": {
        "laboratory": "rig",
        "table": "fit_table",
        "draw": "sample_parameters",
    },
    "rsfstudy.slider.parts": {
        "NOT_NEGATIVE": "NON_NEGATIVE",
        "ANY_COUNT": "NON_NEGATIVE_INTEGER",
        "COUNT": "POSITIVE_INTEGER",
    },
    "rsfstudy.slider.parts:number()": {
        "if_stated": "omit_if_default",
        "omit_if_none": "omit_if_default",
    },
    "rsfstudy.slider.parts:Part": {
        "called_by": "field_name_that_selects_part",
        "selecting_field_name": "field_name_that_selects_part",
        "conclusions": "members_derived_from_equations",
        "equations": "members_defining_equations",
        "no_meaning": "rejection_condition_and_remedy",
        "receives": "received_quantity_names",
        "functions": "list_required_function_names",
        "refuse": "build_field_rejection_error",
        "invalid": "build_field_error",
        "resting": "steady_states",
        "stress_left": "state_relaxation_function",
        "seepage": "auxiliary_rates",
        "seeped": "auxiliary_steady_states",
        "numbers": "parameter_values",
    },
    "rsfstudy.slider.laws": {
        "LawOfStates": "LawBase",
    },
    "rsfstudy.slider.laws:LawBase": {
        "states": "state_count",
        "orbits_close": "has_closed_orbits_at_critical_stiffness",
        "logarithmic": "has_logarithmic_state",
        "size_over_a": "steady_state_change_per_log_rate_over_a",
        "feels_stress": "depends_on_stress",
        "relaxation": "state_relaxation_function",
    },
    "rsfstudy.slider.laws:Law": {
        "least_weakening": "min_b_over_a_for_weakening",
    },
    "rsfstudy.slider.normal_stress:NormalStress": {
        "follows_friction": "depends_on_shear_stress",
        "weakest": "compute_frictional_stress_lower_bound",
    },
    "rsfstudy.slider.dynamics:Dynamics": {
        "reverses": "allows_reversed_slip",
        "radiated": "radiated_stress",
        "damping": "radiated_stress_slope",
        "norm": "compute_slip_rate_norm",
        "slip_rate": "build_slip_rate_functions",
        "rupture_rate": "build_rate_function_for_ruptures",
    },
    "rsfstudy.slider.loading:Loading": {
        "begins": "initial_unknowns",
        "alone": "isolate_segment",
        "told": "reported_segment_start_count",
        "table": "segment_table",
        "jumps": "jump_at_segment_start_mask",
        "is_a_step": "perturbs_steady_sliding",
        "imposes": "changes_normal_stress",
        "displaces": "adds_load_point_displacement_unknown",
        "presses": "adds_normal_stress_unknowns",
    },
    "rsfstudy.slider.parameter_layout": {
        "LOG_LOAD_RATE": "LOG_LOAD_VELOCITY",
        "IMPOSED": "IMPOSED_NORMAL_STRESS",
        "RECHARGE": "BOUNDARY_PRESSURE_RATE",
    },
    "rsfstudy.slider.scene_base:SceneBase": {
        "under": "with_segment",
        "acting": "segment_scene",
        "chains": "segment_sequences_without_jumps",
        "unforced": "steadily_loaded_scene",
        "made": "result_cache",
        "layout": "field_lookup",
        "own_parts": "user_parts",
        "states": "state_count",
        "log_load_rate": "log_load_velocity",
        "log_norm_rate": "log_slip_rate_at_instability",
        "log_instability_rate": "log_slip_rate_at_instability",
        "pressure_source": "part_changing_effective_stress",
        "steady_sliding": "compute_steady_sliding",
        "all_critical_stiffnesses": "compute_all_critical_stiffnesses",
        "largest_linear_growth_rate": "compute_largest_linear_growth_rate",
        "min_steady_log_slip_rate": "find_min_steady_log_slip_rate",
        "quasi_static_log_slip_rate": "compute_quasi_static_log_slip_rate",
        "is_disturbed": "is_perturbed",
        "begins_elsewhere": "starts_unsteady",
        "numbers_of_friction": "friction_parameter_values",
        "shown": "iterate_quantities_with_values",
        "numbers": "parameter_values",
    },
    "rsfstudy.slider.motion_point:MotionPoint": {
        "growth": "log_slip_rate_derivative",
        "friction": "frictional_stress",
        "imbalance": "steady_state_offset",
        "coefficient": "friction_coefficient",
        "reading": "apparent_friction",
        "reading_growth": "apparent_friction_derivative",
    },
    "rsfstudy.slider.friction:FrictionFunctions": {
        "effective_stress": "effective_normal_stress",
        "outer_stress": "measured_effective_normal_stress",
        "outer_pressure": "boundary_pressure",
        "contribution": "state_contribution_to_friction",
        "by_pressure": "strength_derivatives_by_pressure",
        "states_at": "states_from_strength",
        "imposed": "load_point_oscillation_stress",
        "imposed_change": "load_point_oscillation_stress_change",
        "states": "state_count",
        "counted": "state_indices_in_steady_state_distance",
    },
    "rsfstudy.slider.equations:EquationsOfMotion": {
        "rate": "rate_function",
        "point": "motion_point_function",
        "p": "parameters",
        "states": "state_count",
        "balance": "force_balance_function",
        "rates": "evaluate_rates",
        "at": "evaluate_motion_point",
    },
    "rsfstudy.motion.accuracy:Accuracy": {
        "at": "with_rtol",
        "solver": "local_tolerance",
        "switch_weight": "max_inertia_weight_on_slow_manifold",
        "switch_correction": "max_log_slip_rate_change_by_inertia",
        "remaining_slip": "max_slip_in_return_to_slow_manifold",
    },
    "rsfstudy.motion.work_meter": {
        "Halt": "MotionStopped",
        "Meter": "WorkMeter",
    },
    "rsfstudy.motion.work_meter:WorkMeter": {
        "spent": "evaluations",
        "check": "check_budget",
        "settle": "charge_work_since_last_call",
        "by_regime": "evaluations_by_regime",
    },
    "rsfstudy.motion.integration_events": {
        "Kind": "EventKind",
        "settling": "approach_to_steady_state",
    },
    "rsfstudy.motion.integration_events:maximum()": {
        "of": "quantity",
        "ends": "terminal",
        "waits": "may_report_later",
    },
    "rsfstudy.motion.integration_events:minimum()": {
        "of": "quantity",
        "ends": "terminal",
        "waits": "may_report_later",
    },
    "rsfstudy.motion.integration_events:rise()": {
        "of": "quantity",
        "to": "level",
        "ends": "terminal",
        "waits": "may_report_later",
    },
    "rsfstudy.motion.integration_events:fall()": {
        "of": "quantity",
        "to": "level",
        "ends": "terminal",
        "waits": "may_report_later",
    },
    "rsfstudy.motion.integration_events:approach_to_steady_state()": {
        "part": "fraction",
        "ends": "terminal",
    },
    "rsfstudy.motion.integration_events:EventSpecification": {
        "of": "quantity",
        "ends": "terminal",
        "waits": "may_report_later",
    },
    "rsfstudy.motion.integration_events:Event": {
        "watch": "specification",
        "work": "evaluation_count",
        "evaluations": "evaluation_count",
    },
    "rsfstudy.motion.python_backend:PythonMotionState": {
        "lasts": "end_time",
        "taken": "step_length",
        "finer": "step_limit_factor",
        "pace": "time_per_step",
        "resolved": "dense_output_limit",
        "begins": "pending_start",
        "length": "next_step_length",
        "records": "recording_mode",
        "kinks": "kinks_ahead",
        "reported": "reported_kinks",
        "spent_slow": "evaluations_slow",
        "spent_fast": "evaluations_fast",
        "started": "regime_start_time",
        "reverses": "may_reverse",
        "terminates": "may_terminate",
        "limits_steps": "clock_is_path_length",
        "sampled": "samples_taken",
        "target": "target_time",
        "urgent": "must_report",
        "at_point": "starts_at_point",
        "stress": "final_normal_stress",
        "behind": "unknowns_behind_fluid",
        "recorded": "recorded_rows",
        "events": "event_rows",
    },
    "rsfstudy.motion.workspace:Workspace": {
        "new": "y_end",
        "step": "order_eight_step_block",
        "dense": "dense_output_rows",
        "within": "y_within",
        "slopes": "dense_slopes",
        "before": "point_at_begin",
        "after": "point_at_end",
        "between": "point_within",
        "when": "event_clocks",
        "specified": "event_spec_count",
        "p": "parameters",
        "p_before": "parameters_before",
        "unknowns": "unknown_count",
    },
    "rsfstudy.motion.steppers:Stepper": {
        "reach": "step_to_segment_end",
        "begin": "begin_regime",
        "attempt": "attempt_step",
        "unknowns_at": "interpolate_unknowns",
        "retake": "retake_step",
    },
    "rsfstudy.fitting.record:Record": {
        "stated": "specified_steps",
        "found": "loading_steps",
    },
    "rsfstudy.fitting.record:Record()": {
        "stated": "specified_steps",
    },
    "rsfstudy.measures": {
        "TAKEN": "RESERVED_NAMES",
        "Plain": "PlainValue",
        "Value": "OutputValue",
    },
    "rsfstudy.measure_base._recording_measure": {
        "Recorded": "RecordingMeasure",
        "recorded": "create_outputs_along_phase",
    },
    "rsfstudy.measure_base.measure:Measure": {
        "find": "compute",
        "headline": "primary_output",
        "sought": "solved_fields",
        "clocks": "needs_time",
        "scales": "error_scales",
        "charged": "run_nested",
        "metered": "run_metered",
        "classes": "result_determining_classes",
        "restored_fields": "fields_from_description",
        "optional": "optional_output_names",
        "estimated": "names_of_outputs_with_error",
        "typical_work": "typical_rhs_evaluations",
        "work_by_digits": "relative_cost_by_digits",
        "inner_coordinates": "output_coordinates",
        "plain_fields": "scalar_field_values",
    },
    "rsfstudy.api.study_runs:plot()": {
        "own": "user_figure",
    },
    "rsfstudy.plots._figure_drawing:draw_figure()": {
        "own": "user_figure",
    },
    "rsfstudy.plots._figure_drawing:save_figure()": {
        "own": "user_figure",
    },
    "rsfstudy.plots._image_files:render_figure()": {
        "drawn": "figure",
        "form": "image_format",
    },
    "rsfstudy.plots._style:style_context()": {
        "over": "user_styles",
    },
    "rsfstudy.plots._reference_agreement:draw_agreement()": {
        "enough": "required_digits",
    },
    "rsfstudy.plots._text_formatting:format_slope()": {
        "most": "max_decimals",
    },
    "rsfstudy.storage.results_comparison:ResultsComparison": {
        "points": "differing_axis_points",
        "cells": "finished_cell_counts",
        "numbers": "agreement_table",
        "left_out": "uncompared_variables",
    },
}


def find_stacklevel_of_user_code() -> int:
    """Return the ``stacklevel`` that attributes a warning to user code.

    Returns
    -------
    int
        Value that the calling function passes as ``stacklevel`` to ``warnings.warn``.
    """
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == "rsfstudy":
        level, frame = level + 1, frame.f_back
    return level


def warn_renamed(former_name: str, new_name: str, owner_name: str) -> None:
    """Emit the deprecation warning for a former name.

    Parameters
    ----------
    former_name : str
        Former name of a member, a keyword or a module attribute.
    new_name : str
        New name.
    owner_name : str
        Name of the class, function or module. The warning contains this name.
    """
    text = (
        f"{former_name!r} of {owner_name} is now called {new_name!r}. The old name will be "
        "removed in 1.0.0."
    )
    warnings.warn(text, DeprecationWarning, stacklevel=find_stacklevel_of_user_code())


def build_getattr_for_former_names(module_name: str) -> Callable[[str], Any]:
    """Return a module ``__getattr__`` that looks up former names.

    Parameters
    ----------
    module_name : str
        Full name of the module. The name must be a key of ``NEW_NAME_BY_OWNER_AND_FORMER_NAME``.

    Returns
    -------
    callable
        Function to assign to ``__getattr__`` in the module.
    """

    def __getattr__(name: str) -> Any:  # noqa: N807
        if (new := NEW_NAME_BY_OWNER_AND_FORMER_NAME[module_name].get(name)) is None:
            raise AttributeError(f"module {module_name!r} has no attribute {name!r}")
        warn_renamed(name, new, module_name)
        return operator.attrgetter(new)(importlib.import_module(module_name))

    return __getattr__


def add_former_member_names(
    owner_class: DecoratedClass, *, allow_assignment: bool = False
) -> DecoratedClass:
    """Add the former names of members to a class.

    Parameters
    ----------
    owner_class : type
        Class with renamed members. The class is modified in place.
    allow_assignment : bool, default: False
        If True, values can also be assigned under the former names.

    Returns
    -------
    type
        The modified class.
    """
    for former, new in NEW_NAME_BY_OWNER_AND_FORMER_NAME[
        _format_module_and_qualified_name(owner_class)
    ].items():
        setattr(
            owner_class,
            former,
            (_WritableFormerNameDescriptor if allow_assignment else _FormerNameDescriptor)(
                former, new
            ),
        )
    return owner_class


def translate_former_member_name(owner_class: type, member_name: str) -> str:
    """Return the new name of a class member.

    Parameters
    ----------
    owner_class : type
        Class with renamed members.
    member_name : str
        Former or new name of a member. A former name causes a deprecation warning.

    Returns
    -------
    str
        New name. A name that is not a former name is returned unchanged.
    """
    new = NEW_NAME_BY_OWNER_AND_FORMER_NAME[_format_module_and_qualified_name(owner_class)].get(
        member_name, member_name
    )
    if new != member_name:
        warn_renamed(member_name, new, owner_class.__name__)
    return new


def copy_former_overrides_to_new_names(subclass: type) -> None:
    """Add the new names of members that a subclass defines under former names.

    If the subclass also defines the new name, the former name is ignored. If a dataclass field has
    a former name, and the base class has a property with the new name, the subclass gets a property
    with the new name that returns the value of the field. If the base class has no such property,
    the subclass is not changed for this field.

    Parameters
    ----------
    subclass : type
        Subclass of a class with renamed members. The subclass is modified in place.
    """
    for base in subclass.__mro__[1:]:
        for former, new in NEW_NAME_BY_OWNER_AND_FORMER_NAME.get(
            _format_module_and_qualified_name(base), {}
        ).items():
            own, annotation = (
                vars(subclass),
                vars(subclass).get("__annotations__", {}).get(former, ""),
            )
            is_field = annotation != "" and "ClassVar" not in str(annotation)
            if new in own or not (former in own or is_field):
                continue
            if is_field and not isinstance(getattr(base, new, None), property):
                continue
            warn_renamed(former, new, subclass.__name__)
            setattr(
                subclass, new, _build_property_reading_field(former) if is_field else own[former]
            )


def accept_former_keyword_names(function_or_class: DecoratedFunction) -> DecoratedFunction:
    """Accept the former names of keyword arguments.

    Parameters
    ----------
    function_or_class : callable or type
        Function or class with renamed parameters.

    Returns
    -------
    callable or type
        Wrapped function, or the class with a wrapped constructor.
    """
    table = NEW_NAME_BY_OWNER_AND_FORMER_NAME[
        f"{_format_module_and_qualified_name(function_or_class)}()"
    ]
    owner: Any = function_or_class
    wrapped = owner.__init__ if isinstance(function_or_class, type) else function_or_class

    @functools.wraps(wrapped)
    def wrapper(*args: Any, **keywords: Any) -> Any:
        # The function dataclasses.replace passes the current values under the new names.
        for former in table.keys() & keywords.keys() if keywords else ():
            warn_renamed(former, table[former], f"{function_or_class.__name__}()")
            keywords[table[former]] = keywords.pop(former)
        return wrapped(*args, **keywords)

    if not isinstance(function_or_class, type):
        return wrapper  # type: ignore[return-value]
    owner.__init__ = wrapper
    return function_or_class


class _FormerNameDescriptor:
    """Descriptor that looks up a member by its new name."""

    def __init__(self, former_name: str, new_name: str) -> None:
        """Store the former name and the new name."""
        self.former, self.new = former_name, new_name

    def __get__(self, instance: Any, owner: type) -> Any:
        """Return the member with the new name."""
        annotated = any(self.former in vars(c).get("__annotations__", {}) for c in owner.__mro__)
        if instance is None and annotated:  # dataclass() looks up field defaults
            raise AttributeError(self.former)
        warn_renamed(self.former, self.new, owner.__name__)
        target = owner if instance is None else instance
        # A class that defines the former name can reach this code only through super().
        defining = [c for c in owner.__mro__ if vars(c).get(self.former, self) is not self]
        return getattr(super(defining[-1], target) if defining else target, self.new)


class _WritableFormerNameDescriptor(_FormerNameDescriptor):
    """Descriptor of a field that can also be assigned under its former name."""

    def __set__(self, instance: Any, value: Any) -> None:
        """Assign a value to the member with the new name."""
        warn_renamed(self.former, self.new, type(instance).__name__)
        setattr(instance, self.new, value)


def _build_property_reading_field(field_name: str) -> property:
    """Return a property that reads the value of a field."""
    return property(lambda self: getattr(self, field_name))


def _format_module_and_qualified_name(class_or_function: Any) -> str:
    """Return the key that ``NEW_NAME_BY_OWNER_AND_FORMER_NAME`` uses for a class or function."""
    return f"{class_or_function.__module__}:{class_or_function.__qualname__}"
