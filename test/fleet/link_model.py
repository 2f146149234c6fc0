"""Every history of one link, for bounds that are small: the real sides, an abstract plan, and a network that keeps all.

Any message ever sent may arrive at any time, any number of times or never, which covers loss, delay, doubling and
disorder. Of a plan only this is known: which contracts it satisfies, whether it rests and where. A test of the own
plan may go either way. Each side and each message is a small number, and what becomes of a side is looked up, so that
a state is a tuple of numbers.

The world's distance is one of four zones: in sight, a margin beyond, two margins, and farther. Between two looks of
one side it changes by one zone, or the next look comes after a gap.
"""
from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

from mobile_planning.fleet.link import Held, Terms
from mobile_planning.fleet.message import LinkMode
from mobile_planning.fleet.owner_side import OwnerSide
from mobile_planning.fleet.peer_side import PeerSide

#: One tick is longer than a lease, and who rests at a tick has rested for a plan's time.
TERMS = Terms(lease=0.5, rest_time=0.0)
SEEING = Terms(lease=0.5, rest_time=0.0, sensor_range=1.0, margin=1.0, gap=0.5)
DISTANCES = (0.5, 1.5, 2.5, 3.5)


_NO_LEASE = {'granted': -1, 'granted_at': -inf, 'leased_at': -inf}


class Stub(NamedTuple):
    """Stands for a contract."""

    id: int
    epoch: int
    #: A contract that keeps no range.
    tether = None


class Status(NamedTuple):
    """Stands for the message of a cycle, and for an answer."""

    epoch: int
    entry: object
    tick: int
    place: tuple | None


class Offered(NamedTuple):
    epoch: int
    peer_epoch: int
    contract: Stub
    base: int


class Certificate(NamedTuple):
    epoch: int
    place: tuple
    issued: int
    of_owner: bool


class State(NamedTuple):
    """Numbers of the two sides; what is true of the two plans; the zone; the network as a bit set of messages."""

    sides: tuple[int, int]
    satisfied: tuple[int, int]
    places: tuple[int, int] = (0, 0)
    rests: tuple[bool, bool] = (True, True)
    alive: tuple[bool, bool] = (True, True)
    tick: int = 0
    base: int = -1
    zone: int = 0
    ranges: tuple[tuple[int, int], tuple[int, int]] = ((0, 0), (0, 0))
    net: int = 0


@dataclass
class Result:
    """What the search found; ``trace`` is a shortest history that breaks safety, None if there is none."""

    states: int
    is_complete: bool
    trace: list[str] | None


@dataclass
class Model:
    """One link within bounds.

    Attributes
    ----------
    offers : int
        Per life of the owner.
    epochs : (owner's, peer's) int
    ticks, departures : int
        Of the common time; of each robot from rest. With a sensor a tick is a change of the zone.
    is_seeing : bool
        Whether there is a presence sensor with a range.
    kills : (owner, peer) bool
        Who may die for good, with a certificate.
    owner, peer : type
        The sides; a weakened rule is a subclass.
    start : (owner's, peer's) LinkMode
    has_contract : bool
        Whether they start with a contract, in force for both.
    zone : int
        Where the pair starts.
    path : tuple of int
        The zones after that, one a tick; any neighbours if empty.
    do_rest : bool
        Whether the robots start at rest, and come to rest; else they are on their way all the time.
    do_both_convert, does_test_own_plan : bool
        Rules that are no part of a side: the peer takes a silent owner for a disc; it takes no offer without a test.
    """

    offers: int = 2
    epochs: tuple[int, int] = (1, 1)
    ticks: int = 0
    departures: int = 1
    is_seeing: bool = False
    kills: tuple[bool, bool] = (False, False)
    owner: type = OwnerSide
    peer: type = PeerSide
    start: tuple[LinkMode, LinkMode] = (LinkMode.NONE, LinkMode.NONE)
    has_contract: bool = False
    zone: int = 0
    path: tuple[int, ...] = ()
    do_rest: bool = True
    do_both_convert: bool = False
    does_test_own_plan: bool = True

    def __post_init__(self):
        self.ticks = len(self.path) or self.ticks
        self.terms = SEEING if self.is_seeing else TERMS
        self._sides, self._numbers = [], {}
        self._messages, self._bits = [], {}
        self._contracts = {}
        self._known, self._effects, self._addressed = {}, {}, [0, 0]

    # Numbers for sides, messages and contracts

    def _side(self, side):
        if not self.do_rest:
            # No lease is ever asked for, so that what is known of leases only multiplies the states.
            side = replace(side, **{name: value for name, value in _NO_LEASE.items() if hasattr(side, name)})
        if side not in self._numbers:
            self._numbers[side] = len(self._sides)
            self._sides.append(side)
        return self._numbers[side]

    def _bit(self, message):
        if message not in self._bits:
            self._bits[message] = 1 << len(self._messages)
            self._addressed[message[0]] |= self._bits[message]
            self._messages.append(message)
        return self._bits[message]

    def _set(self, contracts):
        bits = 0
        for contract in contracts:
            bits |= 1 << self._contracts.setdefault(contract, len(self._contracts))
        return bits

    # The search

    def search(self, limit: int = 1_000_000) -> Result:
        """Visit every state within the bounds, or ``limit`` of them, deepest first, which leaves out the most."""
        return self._search(deque.pop, limit)

    def shortest(self, limit: int = 1_000_000) -> Result:
        """Visit the states in the order of their events, until one breaks safety."""
        return self._search(deque.popleft, limit)

    def _search(self, take, limit):
        sides = [cls(1, mode=mode) for cls, mode in zip((self.owner, self.peer), self.start)]
        if self.has_contract:
            held, both = Held(Stub(1, 1), 0.0, 0), {'mode': LinkMode.CON, 'other_epoch': 1, 'promised': 1}
            sides = [replace(sides[0], contracts=(held,), acknowledged=1, next_id=2, **both),
                     replace(sides[1], contract=held, **both)]
        bound = self._set(sides[0].bound())
        start = self._said(State(tuple(map(self._side, sides)), (bound, bound), zone=self.zone, base=0 if bound else -1,
                                 ranges=((self.zone, self.zone),) * 2, rests=(self.do_rest,) * 2))
        seen, queue, strongest = {start: None}, deque([start]), {}
        while queue and len(seen) <= limit:
            state = take(queue)
            for what, after in self._successors(state):
                if after is None:
                    return Result(len(seen), False, [*self._history(seen, state), what])
                if after not in seen and self._is_new(strongest, after):
                    seen[after] = state, what
                    queue.append(after)
        return Result(len(seen), not queue, None)

    @staticmethod
    def _history(seen, state):
        history = []
        while seen[state] is not None:
            state, what = seen[state]
            history.append(what)
        return history[::-1]

    @staticmethod
    def _is_new(strongest, state):
        """Return whether no state met before allows all that ``state`` does, and keep it if so.

        More messages allow more to happen, and of that less is safe with fewer contracts satisfied; nothing else
        depends on these.
        """
        key = state[:1] + state[2:-1]
        net, (owner, peer) = state.net, state.satisfied
        met = strongest.setdefault(key, [])
        for other, has_owner, has_peer in met:
            if not (net & ~other or has_owner & ~owner or has_peer & ~peer):
                return False
        met[:] = [(other, has_owner, has_peer) for other, has_owner, has_peer in met
                  if other & ~net or owner & ~has_owner or peer & ~has_peer]
        met.append((net, owner, peer))
        return True

    def _said(self, state):
        """Return the state in which both have said what they now have to say."""
        net = state.net
        for who in (0, 1):
            if state.alive[who]:
                key = state.sides[who], state.tick, state.places[who], state.rests[who]
                if key not in self._known:
                    side = self._sides[key[0]]
                    # Nobody reads the owner's sequence; the place is read after a restart.
                    tick = state.tick if who == 1 else 0
                    place = (float(key[2]), 0.0) if key[3] else None
                    self._known[key] = self._bit((1 - who, Status(side.epoch, side.status(), tick, place)))
                net |= self._known[key]
        return state if net == state.net else state._replace(net=net)

    def _with(self, state, who, number, **changes):
        """Return the state in which the side of ``who`` is ``number``, and has said so."""
        sides = (number, state.sides[1]) if who == 0 else (state.sides[0], number)
        return self._said(state._replace(sides=sides, **changes))

    def _successors(self, state):
        """Yield every event and the state after it; None for one that breaks safety."""
        if state.tick < self.ticks:
            yield from self._zones(state) if self.is_seeing else [
                ('tick', self._said(state._replace(tick=state.tick + 1)))]
        for who in (0, 1):
            if state.alive[who]:
                yield from self._own_events(state, who)
            yield from self._fate(state, who)
        if state.alive[0]:
            yield from self._owner_events(state)
        if state.alive[1]:
            yield from self._peer_events(state)
        yield from self._deliveries(state)

    def _own_events(self, state, who):
        """Come to rest, look, and change the plan."""
        if self.do_rest and not state.rests[who]:
            yield f'{who} rests', self._said(state._replace(rests=_put(state.rests, who, True)))
        number, gap = state.sides[who], False
        if self.is_seeing:
            low, high = state.ranges[who]
            gap = high - low > 1
            number = self._memo(('look', number, state.zone, gap, state.tick), lambda: self._sides[number].observed(
                DISTANCES[state.zone], gap, float(state.tick), self.terms))
            ranges = _put(state.ranges, who, (state.zone, state.zone))
            if number != state.sides[who] or ranges != state.ranges:
                yield f'{who} looks', self._with(state, who, number, ranges=ranges)
                return
        side, at_rest = self._sides[number], state.rests[who]
        if at_rest and state.places[who] >= self.departures or not side.may_move(
                float(state.tick), at_rest, self.terms):
            return
        bound = self._set(side.bound())
        if not self._is_safe(state, who, side, bound):
            yield f'{who} commits: not safe', None
        places = _put(state.places, who, state.places[who] + at_rest)
        yield f'{who} commits', self._with(state, who, number, places=places, rests=_put(state.rests, who, False),
                                           satisfied=_put(state.satisfied, who, bound))

    def _is_safe(self, state, who, side, bound):
        """Return whether every plan that keeps to what binds ``who`` is apart from the other's plan in force."""
        other = 1 - who
        is_disc = (side.mode is LinkMode.STATIC and side.place == (float(state.places[other]), 0.0)
                   and state.rests[other])
        return bool(bound & state.satisfied[other]) or is_disc or self.is_seeing and state.zone > 0

    def _fate(self, state, who):
        """A process ends for good, is certified to be dead, or starts anew with the next epoch."""
        side = self._sides[state.sides[who]]
        if state.alive[who] and self.kills[who]:
            yield f'{who} dies', state._replace(alive=_put(state.alive, who, False))
        if not state.alive[who] and not state.rests[who]:
            yield f'{who} rests', state._replace(rests=_put(state.rests, who, True))
        if not state.rests[who]:
            return
        if not state.alive[who]:
            certificate = (1 - who, Certificate(side.epoch, (float(state.places[who]), 0.0), state.tick, who == 0))
            bit = self._bit(certificate)
            if not state.net & bit:
                yield f'{who} is certified', state._replace(net=state.net | bit)
        if side.epoch < self.epochs[who] and (state.alive[who] or self.kills[who]):
            number = self._side((self.owner, self.peer)[who](side.epoch + 1, born=float(state.tick)))
            changes = {'base': -1} if who == 0 else {}
            yield f'{who} restarts', self._with(state, who, number, alive=_put(state.alive, who, True), **changes)

    def _owner_events(self, state):
        number = state.sides[0]
        side = self._sides[number]
        if side.next_id <= self.offers and side.may_offer(self.terms) and state.base >= 0:
            contract = Stub(side.next_id, side.epoch)
            after = self._memo(('offer', number, state.tick, state.base),
                               lambda: side.offering(contract, state.base, float(state.tick)))
            bit = self._bit((1, Offered(side.epoch, side.other_epoch, contract, state.base)))
            satisfied = _put(state.satisfied, 0, state.satisfied[0] | self._set([contract]))
            yield f'0 offers {contract.id}', self._with(state, 0, after, satisfied=satisfied, net=state.net | bit)
        if state.rests[1] and state.ranges[0] == (state.zone, state.zone):
            after = self._memo(('watch', number, state.places[1], state.tick), lambda: side.watching(
                (float(state.places[1]), 0.0), 0.2, 0.0, False, float(state.tick), self.terms, _is_clear))
            if after != number:
                yield '0 converts', self._with(state, 0, after)

    def _peer_events(self, state):
        number = state.sides[1]
        side = self._sides[number]
        if side.pending is not None:
            after = self._memo(('reconsider', number), lambda: side.reconsidering(_fits))
            yield '1 reconsiders', self._taken(state, after)
        if (self.do_both_convert and side.mode is LinkMode.CON and state.rests[0]
                and state.tick - side.leased_at >= self.terms.lease):
            after = self._memo(('convert', number, state.places[0]),
                               lambda: side._without_contracts().rests_at((float(state.places[0]), 0.0), 0.2))
            yield '1 converts', self._with(state, 1, after)

    def _taken(self, state, number):
        """Return the state after the peer's own test has passed on what it now holds."""
        satisfied = state.satisfied
        if self.does_test_own_plan:
            satisfied = _put(satisfied, 1, satisfied[1] | self._set(self._sides[number].bound()))
        return self._with(state, 1, number, satisfied=satisfied)

    def _deliveries(self, state):
        """Yield what every message that was ever sent does now, if it does anything."""
        for to in (0, 1):
            if state.alive[to]:
                number, base = state.sides[to], state.base if to == 0 else 0
                key = to, number, state.tick, base
                if key not in self._effects:
                    self._effects[key] = [0, []]
                effects = self._effects[key]
                for index in _indices(state.net & self._addressed[to] & ~effects[0]):
                    effects[1] += ((1 << index, *effect)
                                   for effect in self._effects_of(number, index, state.tick, base))
                    effects[0] |= 1 << index
                for bit, what, is_taken, after, new_base in effects[1]:
                    if state.net & bit:
                        yield what, (self._taken(state, after) if is_taken else self._with(
                            state, to, after, **({'base': new_base} if to == 0 else {})))

    def _effects_of(self, number, index, tick, base):
        """Return what a message may do to a side: (event, whether its own test has passed, the new side, the base)."""
        to, message = self._messages[index]
        if isinstance(message, Offered):
            found = [(f'1 hears offer {message.contract.id} of epoch {message.epoch}, {fits.__name__}', True,
                      self._take_offer(number, message, fits), base) for fits in (_fits, _fits_not)]
        else:
            after, is_current = self._hear(number, message, tick)
            new_base = max(base, message.tick) if is_current and to == 0 else base
            found = [(f'{to} hears {message}', False, after, new_base)]
        return [effect for effect in found if effect[2] != number or effect[3] != base]

    def _take_offer(self, number, message, fits):
        held = Held(message.contract, float(message.base), message.base)
        return self._side(self._sides[number].offered(message.epoch, message.peer_epoch, held, fits))

    def _hear(self, number, message, tick):
        """Return the number of the side after a message, and whether that was one of the other's present life."""
        side = self._sides[number]
        if isinstance(message, Certificate):
            return self._side(side.buried(message.epoch, message.place, 0.2, float(message.issued), _is_clear)), False
        if side.is_past(message.epoch):
            return number, False
        if message.epoch > side.other_epoch:
            side = side.renewed(message.epoch, message.place, 0.2, _is_clear)
            if side.other_epoch != message.epoch:
                return number, False
        sent = {seq: float(seq) for seq in range(self.ticks + 1)}
        return self._side(side.reading(message.entry, message.tick, float(tick), sent, self.terms).hearing()), True

    def _memo(self, key, make):
        """Return what ``make`` makes, as the number of a side if it is one, made once for a key."""
        if key not in self._known:
            made = make()
            self._known[key] = self._side(made) if isinstance(made, (OwnerSide, PeerSide)) else made
        return self._known[key]

    def _zones(self, state):
        for zone in self.path[state.tick:state.tick + 1] if self.path else (state.zone - 1, state.zone + 1):
            if 0 <= zone < len(DISTANCES):
                # Beyond one zone it is a gap, however far.
                ranges = tuple(_widened(low, high, zone) for low, high in state.ranges)
                yield f'zone {zone}', self._said(state._replace(zone=zone, ranges=ranges, tick=state.tick + 1))


def _widened(low, high, zone):
    """Return the range of zones since a look; one that is wider than two is a gap, however wide."""
    low, high = min(low, zone), max(high, zone)
    return (low, high) if high - low <= 1 else (0, len(DISTANCES) - 1)


def _indices(bits):
    """Return which bits are set."""
    return [index for index in range(bits.bit_length()) if bits >> index & 1]


def _put(pair, who, value):
    return (value, pair[1]) if who == 0 else (pair[0], value)


def _fits(contract):
    return True


def _fits_not(contract):
    return False


def _is_clear(place, radius):
    return True
