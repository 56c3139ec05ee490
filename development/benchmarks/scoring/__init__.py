"""Scores against known truth: counts of each scene, figures of pooled scenes with 95 % intervals. Needs no ROS.

    counts = [score_people(folder, frames) for folder, frames in runs]     # people.py; hands, signals alike
    figures(counts, people.STATISTICS)['visible_100'].interval             # '0.961 [0.949, 0.972]'
    differences(counts_before, counts_after, people.STATISTICS)            # of two runs on the same scenes, paired
    figures(by_tag(counts, 'sensor')['xtion'], people.STATISTICS)          # of a part of them
"""
