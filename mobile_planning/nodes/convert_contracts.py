"""Contracts, the message, to what a robot offers and answers, and back."""
from __future__ import annotations

from array import array
from collections.abc import Container
from itertools import accumulate

import numpy as np
from mobile_planning_msgs.msg import Contracts as ContractsMessage

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import MAX_LINKS, Contracts, Offer
from mobile_planning.fleet.tether import Tether
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import header


def contracts_message(contracts: Contracts, time: float, frame: str) -> ContractsMessage:
    """Return the message to publish."""
    offers = contracts.offers
    lines = [offer.contract for offer in offers]
    tethers = [contract.tether for contract in lines]
    middles = [tether.middles.ravel() for tether in tethers if tether is not None]
    return ContractsMessage(
        header=header(frame, wire.stamp(time)), version=wire.layout(ContractsMessage), robot_id=contracts.robot_id,
        boot_epoch=contracts.boot_epoch, sequence=contracts.sequence,
        peer=array('I', [offer.peer_id for offer in offers]),
        peer_epoch=array('I', [offer.peer_epoch for offer in offers]),
        base_sequence=array('I', [offer.base_sequence for offer in offers]),
        contract=array('I', [contract.id for contract in lines]),
        first_span=array('q', [contract.first_span for contract in lines]),
        spans=array('H', [len(contract.normals) for contract in lines]),
        normals=wire.floats(np.concatenate([contract.normals.ravel() for contract in lines]) if lines else ()),
        offsets=wire.floats(np.concatenate([contract.offsets.ravel() for contract in lines]) if lines else ()),
        reach=wire.floats([0.0 if tether is None else tether.reach for tether in tethers]),
        middles=wire.floats(np.concatenate(middles) if middles else ()),
        **wire.link_columns(contracts.answers, 'answer_'))


def contracts(message: ContractsMessage, frame: str, to: Container[int] | None = None) -> Contracts:
    """Return what a robot offers and answers.

    Parameters
    ----------
    message : ContractsMessage
    frame : str
        That it must be in.
    to : container of int, optional
        Offers and answers to others than these robots are passed over, and not looked at; by default none is.

    Raises
    ------
    InvalidInput
        The layout, an array's length or a number is not as it must be.
    UnknownFrame
        The message is not in ``frame``.
    """
    wire.check_head(message, frame)
    columns = (message.peer, message.peer_epoch, message.base_sequence, message.contract, message.first_span,
               message.spans, message.reach)
    counts, spans, total = list(map(len, columns)), message.spans, sum(message.spans)
    if len(set(counts)) != 1 or counts[0] > MAX_LINKS:
        raise InvalidInput(f'the arrays of the offers have {counts} entries, not the same number up to {MAX_LINKS}')
    if len(message.normals) != 2 * total or len(message.offsets) != 4 * total:
        raise InvalidInput(f'Contracts has {len(message.normals)} and {len(message.offsets)} numbers for its lines, '
                           f'not 2 and 4 for each of {total}')
    tethers = [count if reach != 0 else 0 for count, reach in zip(spans, message.reach)]
    if len(message.middles) != 8 * sum(tethers):
        raise InvalidInput(f'Contracts has {len(message.middles)} numbers for its middles, not 8 for each of '
                           f'{sum(tethers)}')
    ends, tether_ends = accumulate(spans), accumulate(tethers)
    offers = tuple(_offer(message, row, slice(end - spans[row], end), slice(tether_end - tethers[row], tether_end))
                   for row, end, tether_end in zip(range(counts[0]), ends, tether_ends)
                   if to is None or message.peer[row] in to)
    answers = wire.links(message.answer_peer, message.answer_epoch, message.answer_mode, message.answer_contract,
                         message.answer_promised, message.answer_granted, to=to)
    return Contracts(int(message.robot_id), int(message.boot_epoch), int(message.sequence), tuple(offers), answers)


def _offer(message, row, lines, middles):
    """Return one of the offers, whose ``lines`` and ``middles`` are these of all."""
    normals = np.array(message.normals[2 * lines.start:2 * lines.stop]).reshape(-1, 2)
    offsets = np.array(message.offsets[4 * lines.start:4 * lines.stop]).reshape(-1, 4)
    tether = None
    if message.reach[row] != 0:
        places = np.array(message.middles[8 * middles.start:8 * middles.stop]).reshape(-1, 4, 2)
        tether = Tether(message.reach[row], places)
    contract = Contract(message.contract[row], wire.knot(message.first_span[row]), normals, offsets, tether)
    return Offer(message.peer[row], message.peer_epoch[row], message.base_sequence[row], contract)
