"""Contracts, the message, to what a robot offers and answers, and back."""
from __future__ import annotations

from array import array

import numpy as np
from mobile_planning_msgs.msg import Contracts as ContractsMessage

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import MAX_LINKS, Contracts, Offer
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import header


def contracts_message(contracts: Contracts, time: float, frame: str) -> ContractsMessage:
    """Return the message to publish."""
    offers = contracts.offers
    lines = [offer.contract for offer in offers]
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
               message.spans)
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
        for peer, epoch, base, number, first_span, _, *lines in zip(*(map(int, column) for column in columns),
                                                                    normals, offsets))
    return Contracts(int(message.robot_id), int(message.boot_epoch), int(message.sequence), offers,
                     wire.links(message.answer_peer, message.answer_epoch, message.answer_mode, message.answer_contract,
                                message.answer_promised, message.answer_granted))
