import numpy as np
from tubes import crossing

from knitstudy.loading.history import Recorder, Stations
from knitstudy.loading.load_path import Motion
from knitstudy.loading.restart import Checkpoint
from knitstudy.mechanics.contact.friction import ContactHistory, Coulomb
from knitstudy.mechanics.contact.grids import Grids
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.model import Response
from knitstudy.mechanics.solids_in_contact import ContactMemory, ContactState


def test_a_restart_gives_back_what_contact_points_remember(tmp_path):
    """The next increment is the same to the last bit, friction and multipliers included."""
    nodes, grids, upper = crossing(0.02)
    contact = Contact(
        nodes, Grids(grids), Coulomb(10.0, 7.0, 0.3), meets=~np.eye(2, dtype=bool), margin=0.2, overlap=1e-3
    )
    one, two = (np.where(upper[:, None], shift, 0.0) for shift in ([0, 0, -0.08], [0.02, 0, -0.08]))
    points = contact.points(nodes + one, nodes, ContactHistory.empty())
    points = contact.points(nodes + one, nodes, contact.augment(points))
    state = ContactState(one, ContactMemory(one, 0.25, contact.commit(points)), 0.5, 0.5, 3)
    recorder = Recorder(
        Stations(np.zeros(1, int), np.zeros(1), np.zeros((1, 3))),
        driven=np.array([[0, 1, 2]]),
        motion=Motion(np.zeros((1, 3)), (1.0,), (), axis=0, length=1.0),
    )
    increment = Increment(1, 0.5, state, Response(np.zeros(3), 1.0), 0.5)
    file = Checkpoint(tmp_path / "a.npz", "key", ContactState)
    file.save(increment, recorder)
    back = file.load(recorder).state
    assert (back.load, back.change, back.augmentations, back.memory.damped) == (0.5, 0.5, 3, 0.25)
    for name, value in vars(state.memory.contact).items():
        np.testing.assert_array_equal(getattr(back.memory.contact, name), value)
    there, again = (contact.points(nodes + two, nodes + one, each.memory.contact) for each in (state, back))
    assert len(there.active) > 10
    # Pairs that are open are left out of one and not of the other.
    np.testing.assert_array_equal(there.traction[there.active], again.traction[again.active])
    np.testing.assert_array_equal(there.pressure[there.active], again.pressure[again.active])
