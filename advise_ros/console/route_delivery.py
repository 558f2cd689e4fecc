"""The learnt route for other tools' files and for the vehicle's own mission, as a person asks for it on the page."""

from __future__ import annotations

import threading
from concurrent.futures import Future as Promise

from advise_ros.console.flight_goals import Reply, no, resolve
from advise_ros.console.language import mark
from advise_ros.console.listener import GraphListener
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.missions.from_grid import cells_flown, mission_of
from advise_ros.missions.mission import FORMS, FlightMission
from advise_ros.missions.upload import upload
from advise_ros.recording.place import Place


class RouteDelivery:
    """Puts the section `delivery` on the board: in which forms the route can be had, and what stands against it."""

    def __init__(self, listener: GraphListener, place: Place | None, mission_url: str) -> None:
        """For a session.

        Args:
            listener: has the newest policy and its grid.
            place: of the grid on the earth, None where its file says none.
            mission_url: MAVLink address at which the vehicle takes a mission, '' where there is none. It must not be
                the one that the bridge listens on.
        """
        self._listener, self._place, self._mission_url = listener, place, mission_url
        self._sending = threading.Lock()
        listener.board.put('delivery', {'forms': list(FORMS), 'placed': place is not None, 'vehicle': bool(mission_url)})

    def file(self, form: str) -> Reply:
        """The route as a file's text.

        Args:
            form: ending of the file's name, one of `missions.mission.FORMS`.

        Raises:
            InputError: there is no such form, or no route to write.
        """
        from advise_ros.missions.files import WRITERS  # noqa: PLC0415  its libraries are slow to import

        if form not in FORMS:
            raise InputError(f'{form!r} is no form of a route; there are {", ".join(FORMS)}')
        text = WRITERS[form](self._mission())
        return {'ok': True, 'message': f'the route is in route{form}', 'name': f'route{form}', 'text': text}

    def send(self, promise: Promise[Reply]) -> None:
        """Send the route to the vehicle as its mission; replies when it was read back, which may take a minute.

        Raises:
            InputError: there is no route or no vehicle to send it to, or one is being sent.
        """
        if not self._mission_url:
            raise InputError('the console knows no address of the vehicle: start it with -p mission_url:=udpin:HOST:PORT')
        mission = self._mission()
        if not self._sending.acquire(blocking=False):
            raise InputError('a route is being sent already')
        threading.Thread(target=self._send, args=(mission, promise), name='mission-upload', daemon=True).start()

    def _send(self, mission: FlightMission, promise: Promise[Reply]) -> None:
        try:
            reply: Reply = {'ok': True, 'message': upload(mission, self._mission_url)}
        except AdviseError as problem:
            reply = no(mark('the vehicle does not have the route: {problem}'), problem=str(problem))
        finally:
            self._sending.release()
        resolve(promise, reply)

    def _mission(self) -> FlightMission:
        grid, policy = self._listener.grid, self._listener.policy
        if grid is None or policy is None:
            raise InputError('nothing is learnt yet: fly the route once, or give the learner demonstrations')
        if self._place is None:
            raise InputError('the grid file does not say where it lies on the earth; add origin_wgs84: [latitude, longitude]')
        return mission_of(grid, self._place, cells_flown(grid, list(policy.greedy)))
