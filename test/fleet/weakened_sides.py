"""Sides of a link with one rule taken away, to show that it is needed."""
from dataclasses import replace
from math import inf

from mobile_planning.fleet.message import LinkMode
from mobile_planning.fleet.owner_side import OwnerSide
from mobile_planning.fleet.peer_side import PeerSide


class DropsAllButTheAcknowledged(OwnerSide):
    def acknowledging(self, entry, sequence, now):
        side = super().acknowledging(entry, sequence, now)
        if entry.epoch != self.epoch:
            return side
        alive = tuple(held for held in side.contracts if held.contract.id == entry.contract)
        return replace(side, contracts=alive) if alive else side


class BindsItselfWhenAcknowledged(OwnerSide):
    def bound(self):
        return tuple(held.contract for held in self.contracts if held.contract.id == self.acknowledged)


class ForgetsItsPromise(PeerSide):
    def offered(self, owner_epoch, peer_epoch, offer, fits):
        return replace(self, promised=0).super_offered(owner_epoch, peer_epoch, offer, fits)

    def super_offered(self, *arguments):
        return super().offered(*arguments)


class NeedsNoLease(PeerSide):
    def _has_lease(self, now, at_rest, terms):
        return True


class BelievesOldLives:
    def is_past(self, epoch):
        return False


class OwnerWithoutEpochs(BelievesOldLives, OwnerSide):
    def acknowledging(self, entry, sequence, now):
        return super().acknowledging(replace(entry, epoch=self.epoch), sequence, now)


class PeerWithoutEpochs(BelievesOldLives, PeerSide):
    def offered(self, owner_epoch, peer_epoch, offer, fits):
        return super().offered(self.other_epoch or owner_epoch, self.epoch, offer, fits)

    def leasing(self, entry, sent_at):
        return super().leasing(replace(entry, epoch=self.epoch), sent_at)


class AnswersARestartWithADisc:
    def renewed(self, epoch, place, radius, clear):
        side = super().renewed(epoch, place, radius, clear)
        is_new = epoch > 1 and place is not None and side.mode is LinkMode.NONE
        return side.rests_at(place, radius) if is_new else side


class OwnerThatAnswersWithADisc(AnswersARestartWithADisc, OwnerSide):
    pass


class PeerThatAnswersWithADisc(AnswersARestartWithADisc, PeerSide):
    pass


class BelievesOldCertificates:
    def buried(self, epoch, place, radius, issued, clear):
        return super().buried(epoch, place, radius, inf, clear)


class OwnerWithOldCertificates(BelievesOldCertificates, OwnerSide):
    pass


class PeerWithOldCertificates(BelievesOldCertificates, PeerSide):
    pass


class HasNoDoubt:
    def _is_doubted(self, since):
        return False


class OwnerWithoutDoubt(HasNoDoubt, OwnerSide):
    pass


class PeerWithoutDoubt(HasNoDoubt, PeerSide):
    pass


class GivesUpAfterAGap:
    def observed(self, distance, is_after_gap, now, terms):
        side = super().observed(distance, is_after_gap, now, terms)
        return replace(side, drop=now)._lapsed() if is_after_gap else side


class OwnerThatGivesUpAfterAGap(GivesUpAfterAGap, OwnerSide):
    pass


class PeerThatGivesUpAfterAGap(GivesUpAfterAGap, PeerSide):
    pass


class OverlooksGaps:
    def observed(self, distance, is_after_gap, now, terms):
        return super().observed(distance, False, now, terms)


class OwnerThatOverlooksGaps(OverlooksGaps, OwnerSide):
    pass


class PeerThatOverlooksGaps(OverlooksGaps, PeerSide):
    pass


class TakesOffersFromBefore(PeerSide):
    def offered(self, owner_epoch, peer_epoch, offer, fits):
        side = replace(self, doubt=-inf).super_offered(owner_epoch, peer_epoch, offer, fits)
        return replace(side, doubt=self.doubt)

    def super_offered(self, *arguments):
        return super().offered(*arguments)


class TrustsItsNewestContract(OwnerSide):
    def _in_force(self):
        return self.contracts[-1]


class TrustsADiscForEver(OwnerSide):
    def observed(self, distance, is_after_gap, now, terms):
        side = super().observed(distance, is_after_gap, now, terms)
        return replace(side, mode=self.mode) if self.mode is LinkMode.STATIC else side


class ConvertsInDoubt(OwnerSide):
    def watching(self, *arguments):
        return replace(self, doubt=-inf).super_watching(*arguments).with_doubt(self.doubt)

    def super_watching(self, *arguments):
        return super().watching(*arguments)

    def with_doubt(self, doubt):
        return replace(self, doubt=doubt)
