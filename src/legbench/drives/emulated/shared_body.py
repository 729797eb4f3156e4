"""One body on the shafts of drives that hang on several emulated channels, in lock-step."""

from collections.abc import Sequence
from typing import final

from legbench.drives.emulated.network import Body, Network
from legbench.drives.emulated.network_time import NetworkTime
from legbench.drives.emulated.pacer import VirtualTime
from legbench.drives.emulated.station import Station


@final
class SharedBody:
    """Body that the networks of several channels move together.

    The network whose tick comes first lets the drives of the others tick, too: nothing happens on
    their wires between their last event and this tick, so that it is what they do themselves.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self._networks: tuple[Network, ...] = ()
        self._at_ns = -1
        self._shown: tuple[Sequence[float], Sequence[float]] = ((), ())

    def join(self, networks: Sequence[Network]) -> None:
        """Let the drives of these networks move the body, in this order."""
        self._networks = tuple(networks)

    def part(self, place: int) -> Body:
        """The body as the network at a place sees it: the links of its own drives."""

        def seen(motor_pos: tuple[float, ...]) -> tuple[Sequence[float], Sequence[float]]:
            self._move(self._networks[place].now_ns)
            first = sum(len(network.drives) for network in self._networks[:place])
            own = slice(first, first + len(motor_pos))
            links, torques = self._shown
            return links[own], torques[own]

        return seen

    def _move(self, now_ns: int) -> None:
        if now_ns == self._at_ns:
            return
        self._at_ns = now_ns
        drives = [drive for network in self._networks for drive in network.drives]
        self._shown = self._body(tuple([drive.tick(now_ns) for drive in drives]))


@final
class LockstepChannels:
    """Time of several networks, which pass it together."""

    def __init__(self, networks: Sequence[Network]) -> None:
        self._networks = tuple(networks)

    def now_ns(self) -> int:
        """Return the present time [ns]."""
        return self._networks[0].now_ns

    def next_ns(self) -> int:
        """Time of the next event of any network [ns]."""
        return min(network.upcoming()[0] for network in self._networks)

    def wait_until(self, at_ns: int) -> None:
        """Advance all networks to `at_ns`."""
        self.advance(at_ns)

    def advance(self, until_ns: int, stations: Sequence[Station] = ()) -> None:
        """Advance virtual time to `until_ns`, or until a frame for one of the stations has come."""
        networks = self._networks
        # An event of one network changes what is next there, and nowhere else.
        upcoming = [network.upcoming() for network in networks]
        now_ns = networks[0].now_ns
        while not any([station.received for station in stations]):
            at_ns, place = min([(entry[0], place) for place, entry in enumerate(upcoming)])
            if at_ns > until_ns:
                now_ns = max(now_ns, until_ns)
                break
            now_ns = max(now_ns, at_ns)
            network = networks[place]
            network.now_ns = now_ns
            upcoming[place][1]()
            upcoming[place] = network.upcoming()
        for network in networks:
            network.now_ns = now_ns


def time_of(networks: Sequence[Network]) -> VirtualTime:
    """Virtual time of one network, or of several that pass it together."""
    return NetworkTime(networks[0]) if len(networks) == 1 else LockstepChannels(networks)
