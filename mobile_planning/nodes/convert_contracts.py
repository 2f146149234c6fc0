"""Contracts, the message, to what a robot offers and answers, and back."""
from __future__ import annotations

from array import array

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


def contracts(message: ContractsMessage, frame: str) -> Contracts:
    """Return what a robot offers and answers.

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
    counts, spans = list(map(len, columns)), np.array(message.spans, int)
    if len(set(counts)) != 1 or counts[0] > MAX_LINKS:
        raise InvalidInput(f'the arrays of the offers have {counts} entries, not the same number up to {MAX_LINKS}')
    if len(message.normals) != 2 * spans.sum() or len(message.offsets) != 4 * spans.sum():
        raise InvalidInput(f'Contracts has {len(message.normals)} and {len(message.offsets)} numbers for its lines, '
                           f'not 2 and 4 for each of {spans.sum()}')
    ends = np.cumsum(spans)[:-1]
    normals = np.split(np.array(message.normals).reshape(-1, 2), ends)
    offsets = np.split(np.array(message.offsets).reshape(-1, 4), ends)
    offers = tuple(
        Offer(peer, epoch, base, Contract(number, wire.knot(first_span), *lines))
        for peer, epoch, base, number, first_span, _, *lines in zip(
            *(map(int, column) for column in columns[:-1]), normals, offsets, _tethers(message, spans)))
    return Contracts(int(message.robot_id), int(message.boot_epoch), int(message.sequence), offers,
                     wire.links(message.answer_peer, message.answer_epoch, message.answer_mode, message.answer_contract,
                                message.answer_promised, message.answer_granted))


def _tethers(message, spans):
    """Return the tether of each offer, None where it has none."""
    reach = np.array(message.reach)
    counts = np.where(reach == 0, 0, spans)
    if len(message.middles) != 8 * counts.sum():
        raise InvalidInput(f'Contracts has {len(message.middles)} numbers for its middles, not 8 for each of '
                           f'{counts.sum()}')
    middles = np.split(np.array(message.middles).reshape(-1, 4, 2), np.cumsum(counts)[:-1])
    return [Tether(most, places) if most != 0 else None for most, places in zip(reach, middles)]
