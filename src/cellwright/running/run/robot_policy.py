"""Policy that works the node of a robot, in the session's process: it has the time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellwright.clients.client.session import NodeClient
from cellwright.running.run.agent_work import POLICY_FAULTS, restored_environment
from cellwright.running.run.session import Program, Session
from cellwright.util.errors import RunEndedError, SimulationError

if TYPE_CHECKING:
    from cellwright.clients.policies.agent import PolicyAgent

NODE = "/policy"
"""Name of the policy's client, as the robot's node sees it."""
INFRASTRUCTURE = "infrastructure"
"""Outcome of a run whose policy could not be asked."""


class RobotPolicy(Program):
    """Program that lets a policy work the robot of a session until the session stops.

    Args:
        agent: asks the policy.
    """

    def __init__(self, agent: PolicyAgent) -> None:
        self.agent = agent

    def work(self, session: Session) -> tuple[str, str]:
        """Let the policy work; return how the run ended, and the error of the policy's server."""
        from cellwright.clients.policies.robot_workplace import RobotWorkplace  # slow to load

        node = session.node
        timestep = node.simulation.clock.timestep.as_integer_ratio()
        client = NodeClient(session.transport(NODE))
        try:
            with restored_environment():
                self.agent.work(RobotWorkplace(client, node.config, timestep))
        except RunEndedError:
            return "stopped" if session.stop.is_requested else "until", ""
        except KeyboardInterrupt:
            return "stopped", ""
        except POLICY_FAULTS as error:
            return INFRASTRUCTURE, str(error)
        except SimulationError as error:
            return "unstable", str(error)
        finally:
            client.close()
        return "stopped", ""
