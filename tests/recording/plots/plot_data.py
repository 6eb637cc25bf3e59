"""Synthetic plot data: a cell that brings two parts, and a robot that waves."""

import numpy as np

from cellwright.recording.plots.tracks import (
    CommandTrack,
    JointTrack,
    Mark,
    PlotData,
    ScoreTrack,
    Span,
    ToolTrack,
    TrackedTrayPart,
)

AGV_1, AGV_2 = "AGV 1", "AGV 2"


def cell() -> PlotData:
    """Return sixty seconds of work."""
    times = np.arange(0.0, 60.0, 0.04)
    names = ["elbow", "rail", "shoulder lift", "shoulder pan", "wrist 1", "wrist 2", "wrist 3"]
    joints = []
    for number, name in enumerate(names):
        targets = np.sign(np.sin(times / (4 + number))) * (0.4 + 0.2 * number) + number / 2
        actual = np.convolve(targets, np.ones(12) / 12, "same")
        actual[:12], actual[-12:] = targets[:12], targets[-12:]
        joints.append(JointTrack(name, "m" if name == "rail" else "rad", times, actual, times, targets))
    path = np.column_stack([-0.4 + 0.8 * np.sin(times / 9), 2.0 * np.cos(times / 9), 0.8 + 0.2 * np.sin(times)])
    held = [Span(10.0, 18.0), Span(30.0, 39.5)]
    return PlotData(
        title="lesson",
        note="kitter, seed 0: 8 of 12 points",
        begin=0.0,
        end=60.0,
        joints={"arm": joints},
        tools=[ToolTrack("vacuum gripper", "world", times, path, [Span(8.0, 18.1), Span(28.0, 40.0)], held)],
        trays=[AGV_1, AGV_2],
        tray_parts=[
            TrackedTrayPart(AGV_1, "piston rod 9", 18.0, 50.0, "right"),
            TrackedTrayPart(AGV_1, "gear 3", 39.5, 50.0, "faulty"),
            TrackedTrayPart(AGV_2, "gear 1", 55.0, 60.0),
        ],
        score=ScoreTrack(np.array([0.0, 50.0]), np.array([0.0, 8.0]), best=12.0),
        marks=[Mark(0.5, "order_0"), Mark(50.0, "order_0_kit_0: 8 of 12", AGV_1), Mark(51.0, "done")],
        states={"competition": [Span(0, 0.5, "init"), Span(0.5, 50.0, "go"), Span(50.0, 60.0, "done")]},
        commands=[CommandTrack("/ariac/arm/command", np.arange(1.0, 50.0, 5.0))],
    )


def robot() -> PlotData:
    """Return twenty seconds of a robot with many joints."""
    times = np.arange(0.0, 20.0, 0.01)
    arm = [JointTrack(f"J_arm_r_{n}", "rad", times, np.sin(times + n / 3) / (n + 1)) for n in range(7)]
    legs = [JointTrack(f"J_leg_{n}", "rad", times, np.zeros_like(times)) for n in range(12)]
    hand = np.column_stack([0.3 + 0.1 * np.sin(times), -0.2 + 0.1 * np.cos(times), 0.1 * np.sin(2 * times)])
    other = hand * [1.0, -1.0, 1.0]
    return PlotData(
        title="qinglong",
        note="robot, 20 s",
        begin=0.0,
        end=20.0,
        joints={"right arm": arm, "legs": legs},
        tools=[ToolTrack("right hand", "base_link", times, hand), ToolTrack("left hand", "base_link", times, other)],
        states={
            "safety": [Span(0, 12, "takes commands"), Span(12, 15, "emergency stop"), Span(15, 20, "takes commands")]
        },
        commands=[
            CommandTrack("/io_teleop/joint_cmd", times[::2]),
            CommandTrack("/io_teleop/set_enabled", np.array([3.0])),
        ],
    )
