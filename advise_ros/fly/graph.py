"""The processes of a session: which executables run, with which parameters, and in which order they end."""

from __future__ import annotations

from advise_ros.fly.options import FlyOptions
from advise_ros.supervisor import Child, Supervisor

# What moves the vehicle ends first, then what learns; the bridge leaves the vehicle standing or holding; the logger has it all.
ENDS_IN_ORDER = (
    ('pilot', 'expert', 'console', 'policy'), ('recorder', 'advise'), ('mavlink_bridge',), ('simulator',), ('logger',),
)
# Of the simulated pilot.
FLIGHTS = 2
WHY = {
    'simulator': 'nothing flies without it',
    'mavlink_bridge': 'the vehicle has no commands any more and stands or holds; take it over by your transmitter',
    'policy': 'the vehicle holds',
    'recorder': 'what is flown teaches nothing any more',
    'advise': 'nothing is learnt any more',
    'logger': 'nothing is recorded any more',
    'console': 'there is no page any more',
    'pilot': 'nobody flies any more',
    'expert': 'nobody answers any more',
}


class FlightGraph:
    """Starts and ends the processes of one session."""

    def __init__(self, options: FlyOptions, supervisor: Supervisor) -> None:
        self._options = options
        self._supervisor = supervisor
        self._children: dict[str, Child] = {}

    def start(self) -> Child:
        """All of them; returns the page, whose log tells its address."""
        options = self._options
        self._start('logger', {'bag': options.bag})
        if options.simulated:
            self._start('simulator', self._simulator())
        self._start('mavlink_bridge', {'url': options.url, 'grid_file': options.grid_file})
        for name in ('recorder', 'policy'):
            self._start(name, {'grid_file': options.grid_file})
        self._start('advise', {
            'grid_file': options.grid_file, 'site_map_file': options.site_map_file, 'site_map_out': options.site_map_out,
        })
        page = self._start('console', {'port': options.port, 'grid_file': options.grid_file})
        if options.actors:
            person = {'grid_file': options.grid_file, 'wish_file': options.wish_file or ''}
            self._start('pilot', {'flights': FLIGHTS, 'heard_by': 'recorder,logger', **person}, may_end=True)
            self._start('expert', person)
        return page

    def end(self) -> tuple[str, ...]:
        """End all of them in order; returns the names of those that had to be killed."""
        killed: tuple[str, ...] = ()
        for group in ENDS_IN_ORDER:
            killed += self._supervisor.stop(*(self._children[name] for name in group if name in self._children))
        return killed

    @property
    def bag_is_whole(self) -> bool:
        """After `end`: the logger has finished its bag."""
        return 'logger' in self._children and self._children['logger'].process.returncode == 0

    @property
    def running(self) -> tuple[str, ...]:
        """The executables that run still."""
        return tuple(name for name, child in self._children.items() if child.process.poll() is None)

    @property
    def names(self) -> tuple[str, ...]:
        """The executables that were started, in order."""
        return tuple(self._children)

    def _start(self, name: str, parameters: dict[str, object], *, may_end: bool = False) -> Child:
        options = self._options
        extra = [] if options.params_file is None else ['--params-file', str(options.params_file)]
        if options.namespace:
            extra += ['-r', f'__ns:={options.namespace}']
        values: dict[str, object] = {key: value for key, value in parameters.items() if value != ''}
        if name != 'simulator':  # It makes the clock; it cannot follow it.
            values['use_sim_time'] = options.simulated_time
        self._children[name] = self._supervisor.start_node(name, values, *extra, may_end=may_end)
        return self._children[name]

    def _simulator(self) -> dict[str, object]:
        """It stands where the route ends, and is ready soon; a parameter file of the user's own has the say in the rest."""
        options = self._options
        east, north = options.grid.centre_enu_m(options.grid.waypoints[-1])
        values: dict[str, object] = {
            'endpoint': options.url.replace('udpin:', 'udpout:'), 'speedup': float(options.speedup),
            'start_east_m': float(east), 'start_north_m': float(north), 'publish_clock': options.simulated_time,
        }
        if options.vehicle:
            values['autopilot'] = options.vehicle
        if options.params_file is None:
            values |= {'ready_after_s': 5.0, 'battery_s': 7200.0}
        return values
