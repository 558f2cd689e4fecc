"""The verdict as JUnit XML, which CI systems show: one test case a stage."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from advise_ros.replay.report import ReplayReport


def to_junit(report: ReplayReport) -> str:
    """One test suite, named by the bag."""
    bag, stages = report.session.bag.path.name, report.asked_stages
    failures = sum(not stage.agrees for stage in stages)
    suite = ET.Element('testsuite', {
        'name': f'replay {bag}', 'tests': str(len(stages)), 'failures': str(failures), 'errors': '0',
        'skipped': str(sum(not stage.checked for stage in stages)), 'time': f'{report.seconds:.3f}',
    })  # fmt: skip
    for stage in stages:
        case = ET.SubElement(suite, 'testcase', {'classname': f'replay.{bag}', 'name': stage.name, 'time': '0'})
        if not stage.agrees:
            wrong = f'{stage.checked - stage.equal} of {stage.checked} differ'
            ET.SubElement(case, 'failure', {'message': stage.difference, 'type': 'difference'}).text = wrong
        elif not stage.checked:
            ET.SubElement(case, 'skipped', {'message': 'none in the bag'})
        if stage.notes:
            ET.SubElement(case, 'system-out').text = '\n'.join(stage.notes)
    ET.SubElement(suite, 'system-out').text = f'{report.asked}\n{report.told_in_bytes}\n{report.verdict}'
    suites = ET.Element('testsuites')
    suites.append(suite)
    ET.indent(suites)
    return ET.tostring(suites, encoding='unicode', xml_declaration=True) + '\n'
