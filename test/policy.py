"""The policy of DDS-Security, as sros2 understands it."""
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree

POLICY = Path(__file__).resolve().parent.parent / 'config' / 'security' / 'policy.xml'
#: What each kind of entity may be allowed to do.
DEEDS = {'topic': ('publish', 'subscribe'), 'service': ('reply', 'request'), 'action': ('execute', 'call')}
#: What one who executes an action answers and publishes.
ACTION = {'reply': ('send_goal', 'cancel_goal', 'get_result'), 'publish': ('feedback', 'status')}


def allowances():
    """Return the patterns of names that each enclave may use, by the last word of its path and by deed.

    A private name, ``~/plan``, has the pattern of its node in front.
    """
    found = {}
    for enclave in ElementTree.parse(POLICY).iterfind('enclaves/enclave'):
        deeds = found[enclave.get('path').rpartition('/')[2]] = {}
        for profile in enclave.iterfind('profiles/profile'):
            own = profile.get('ns').rstrip('/') + '/' + profile.get('node')
            for kind, possible in DEEDS.items():
                for group in profile.iterfind(f'{kind}s'):
                    names = [own + each.text[1:] if each.text.startswith('~') else each.text
                             for each in group.iterfind(kind)]
                    for deed in possible:
                        if group.get(deed) != 'ALLOW':
                            continue
                        deeds.setdefault(deed, []).extend(names)
                        # An action is three services and two topics.
                        for other, parts in ACTION.items() if deed == 'execute' else ():
                            deeds.setdefault(other, []).extend(
                                f'{name}/_action/{part}' for name in names for part in parts)
    return found


def is_allowed(name, patterns):
    """Return whether one of the patterns has the name."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)
