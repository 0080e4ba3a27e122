"""Commands and groups of them: options in panels, the same ones for all; a group with a main command."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperGroup

PANELS = {
    "Input": "example day name packaged file_format control control_crs columns roles images names camera sd"
    " settings cubes jigsaw photos_dir photos_crs gnss gnss_crs gnss_antenna mrk_antenna pixel_origin model"
    " angles grid hand against against_spacing against_position_sd catalogue utc epoch faintest points"
    " point_sd decimals"
    " format zero_missing ground_unit model_unit restart start reject photos kind board spacing unit"
    " shape knots knot_sd cameras size views within sync offsets",
    "Results": "out overwrite json xlsx html no_html plots plot_format parquet crs map ply ply_origin listing"
    " pdf to trace points_out part_two restart_out ident date",
    "Adjustment": "datum datum_points hold loss scale tolerance max_iterations iterations covariance"
    " unit_variance self_calibrate keep_all keep_repeated as_published weights method polynomial"
    " estimate_grid each_case angle lens common_scale without any_roll blind air_refraction"
    " water_refraction water_level water_index limits invert extrapolate components regularise"
    " together calibrate radius distances intrinsics_only knot_grid",
    "Gross errors": "snoop level fdr unit_weight outliers",
    "Uncertainty": "map_distance map_datum noise_only need cross_validate compare_with suggest",
    "Planned views": "plan_views view_field focal away",
    "Features": "distance line plane circle sphere cylinder k coverage",
    "Statement": "standard class_h class_v class_3d area without independent language text budget project"
    " client firm surveyor statement",
    "In parts": "cluster workers parts memory run plan",
    "Simulated block": "strips photos_per_strip forward_overlap side_overlap principal_distance frame_size"
    " flying_height relief points_per_photo crab tilt control_spacing control_sd image_sd"
    " position_sd attitude_sd spheroid origin photo_to_ground check_points position_error"
    " attitude_error blunders blunder_size seed",
    "Motion": "readout readout_sd readout_direction speed speed_sd rate rate_sd scanner view_angle pitch"
    " every knots scenes",
    "Run": "ordering threads strict quiet help",
}
"""Options by the names of their parameters; what is in none is under `Options`."""

PANEL_OF = {option: panel for panel, options in PANELS.items() for option in options.split()}


class Command(TyperCommand):
    """A command whose help has panels, and says of a switch nothing but what it does."""

    def __init__(self, *args: Any, **values: Any) -> None:
        super().__init__(*args, **values)
        # Lines of a docstring are lines of the source.
        self.help = self.help and "\n\n".join(" ".join(each.split()) for each in self.help.split("\n\n"))
        for each in self.params:
            _arrange(each)

    def get_help_option(self, ctx: Any) -> Any:
        """Return --help in its panel."""
        option = super().get_help_option(ctx)
        if option is not None:
            _arrange(option)
        return option


def _arrange(parameter: Any) -> None:
    if parameter.param_type_name != "option":
        return
    parameter.rich_help_panel = PANEL_OF.get(parameter.name)
    # typer shows the type of a switch, which is none that a user writes.
    if parameter.is_flag and parameter.metavar is None:
        parameter.metavar = ""


class GroupWithMain(TyperGroup):
    """A group whose first command is run when the first word names none.

    The job that people come for needs no name; a directory with the name of a side command is `./check`.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the commands in the order in which they were added."""
        return list(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command; the help of the main one, which is that of the group, names the others."""
        command = super().get_command(ctx, cmd_name)
        if command is not None and cmd_name == self._main:
            others = [self.commands[name] for name in self.list_commands(ctx) if name != self._main]
            lines = [
                f"{ctx.command_path} {each.name}: {each.get_short_help_str(limit=200)}" for each in others
            ]
            command.epilog = "\n\n".join(["Other commands:", *lines])
        return command

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the main command before arguments that name no command.

        While a shell completes the first word, either may follow: see :meth:`shell_complete`.
        """
        if (args or not ctx.resilient_parsing) and (not args or args[0] not in self.commands):
            args = [self._main, *args]
        return list(super().parse_args(ctx, args))

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """Return the side commands, and what the main command begins with."""
        main = self.commands[self._main]
        with main.make_context(self._main, [], parent=ctx, resilient_parsing=True) as own:
            return [*super().shell_complete(ctx, incomplete), *main.shell_complete(own, incomplete)]

    @property
    def _main(self) -> str:
        return next(iter(self.commands))
