"""What docs/planning_sim.md says of the document's names, done."""
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / 'docs' / 'planning_sim.md').read_text(encoding='utf-8')
#: The index of planning_sim's document, and what its constructors take.
NAMES = '''_calculate_polygon_area _calculate_polygon_centroid _co_criterion _co_feqcons _co_fieqcons _comb_bsp
_compute_conflicts _create_aug_vertices _detect_obst _gen_knots _log _ls_co_criterion _ls_co_feqcons
_ls_co_fieqcons _ls_sa_criterion _ls_sa_feqcons _ls_sa_fieqcons _plan _plan_section _plt_circle
_sa_criterion _sa_feqcons _sa_fieqcons _solve_opt_pbl _unsigned_angle acc_max Boundary
bounding_circle_radius centroid ctime detected_dist done_planning eyed intended_path_z1 intended_path_z2
k_mod l latest_z Obstacle phi_0 phi_1 phi_2 phi_3 planning_process plot PolygonObstacle pt_2_obst q_dim
q_final q_init radius rho Robot RobotMsg RoundObstacle rtime run set_option sol u_dim u_final u_init
u_max UnicycleKineModel WorldSim x x_max x_min y y_max y_min z_dim z_final z_init N_s n_knots t_init
t_sup Tc Tp Td detec_rho com_range def_epsilon safe_epsilon ls_time_opt_scale dist_opt_offset ls_min_dist
position vertices polygon signed offset name_id robots obstacles phy_boundary neigh kine_model a_max dp ip_z1 ip_z2 lz
value'''.split()


@pytest.mark.parametrize('name', NAMES)
def test_every_name_of_the_document_is_on_the_page(name):
    code = ' '.join(re.findall(r'`([^`]*)`', PAGE))
    assert re.search(rf'(?<!\w){re.escape(name)}(?!\w)', code)


def test_every_file_that_the_page_names_is_there():
    named = set(re.findall(r'`((?:fleet|world|drawing|nodes)/\w+\.py)`', PAGE))
    assert len(named) > 10
    assert [name for name in sorted(named) if not (ROOT / 'mobile_planning' / name).exists()] == []
    assert all((ROOT / 'docs' / name).exists() for name in re.findall(r'\]\((\w+\.png)\)', PAGE))


def test_every_class_and_method_that_the_page_says_is_somewhere_is_defined():
    places = [row.split('|')[2] for row in PAGE.split('## Every name')[1].splitlines() if row.startswith('| `')]
    named = set(re.findall(r'`([A-Z]\w+)(?:\.(\w+))?`', ' '.join(places).replace('`RobotMsg.msg`', '')))
    files = [path.read_text(encoding='utf-8') for path in (ROOT / 'mobile_planning').rglob('*.py')]
    assert len(named) >= 5
    assert [(kind, method) for kind, method in sorted(named) if not any(
        re.search(rf'^class {kind}\b', text, re.MULTILINE) and f'def {method}' in text for text in files)] == []


def test_what_is_public_lives_where_the_page_says():
    rows = [row.split('|')[1:3] for row in PAGE.split('## Every name')[1].splitlines() if row.startswith('| `')]
    said = [(kind, file) for name, place in rows for kind in re.findall(r'`([A-Z][A-Za-z]+)\(', name)
            for file in re.findall(r'`(\w+/\w+\.py)`', place)[:1]]
    assert len(said) == 8
    assert [(kind, file) for kind, file in said if not re.search(
        rf'^class {kind}\b', (ROOT / 'mobile_planning' / file).read_text(encoding='utf-8'), re.MULTILINE)] == []


def test_the_example_of_the_page_runs(capsys):
    (example,) = re.findall(r'```python\n(.*?)```', PAGE, re.DOTALL)
    exec(compile(example, 'planning_sim.md', 'exec'), {})
    assert re.search(r'valid +yes', capsys.readouterr().out)
