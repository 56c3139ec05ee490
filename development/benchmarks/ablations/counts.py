"""temporary scorer"""
import numpy as np
from scipy.optimize import linear_sum_assignment

MM = 1000


def people_counts(truth, order, frames, gate=0.6):
    c = dict(n_gt=0, n_pred=0, n_match=0, vis_n=0, vis_in=0, occ_n=0, occ_in=0, lies=0, sig_n=0, sig_in=0, switches=0)
    hist = np.zeros(600, int)
    last = {}
    for frame, (_, people) in zip(truth['frames'], frames):
        gts = frame['people']
        c['n_gt'] += len(gts)
        c['n_pred'] += len(people)
        gxyz = np.array([p['xyz'] for p in gts], float).reshape(-1, 18, 3)[:, order]
        gvis = np.array([p['vis'] for p in gts], int).reshape(-1, 18)[:, order]
        ok = np.isfinite(people.xyz).all(2) & (people.status > 0)
        e_all = np.linalg.norm(gxyz[:, None] - people.xyz[None], axis=3)
        cost = np.full(e_all.shape[:2], 1e3)
        for a in range(len(gts)):
            for b in range(len(people)):
                m = ok[b] & (gvis[a] == 2)
                if m.sum() < 3:
                    m = ok[b]
                if m.any():
                    cost[a, b] = np.median(e_all[a, b, m])
        cost = np.where(cost <= gate, cost, 1e3)
        mate = {a: b for a, b in zip(*linear_sum_assignment(cost)) if cost[a, b] <= gate} if cost.size else {}
        c['n_match'] += len(mate)
        for a, g in enumerate(gts):
            v, o = gvis[a] == 2, np.isin(gvis[a], (1, 3, 4))
            c['vis_n'] += int(v.sum())
            c['occ_n'] += int(o.sum())
            if a not in mate:
                continue
            b = mate[a]
            e = np.where(ok[b], e_all[a, b], np.nan)
            pid = int(people.ids[b])
            c['switches'] += last.get(g['id'], pid) != pid
            last[g['id']] = pid
            with np.errstate(invalid='ignore'):
                c['vis_in'] += int((e[v] <= 0.1).sum())
                c['occ_in'] += int((e[o] <= 0.15).sum())
                c['lies'] += int((o & (e > 0.15) & (people.status[b] != 2)).sum())
                s = np.isfinite(e) & np.isfinite(people.sigma[b])
                c['sig_n'] += int(s.sum())
                c['sig_in'] += int((e[s] <= 2 * people.sigma[b][s]).sum())
            ev = e[v & np.isfinite(e)]
            hist += np.bincount(np.minimum(ev * MM, 599).astype(int), minlength=600)
    c['hist'] = hist.tolist()
    return c


def image_counts(truth, order, found):
    c = dict(im_gt=0, im_match=0, im_switches=0)
    last = {}
    for frame, people in zip(truth['frames'], found):
        gts = [g for g in frame['people'] if (np.array(g['vis']) == 2).sum() >= 4]
        c['im_gt'] += len(gts)
        cost = np.full((len(gts), len(people)), 1e3)
        for a, g in enumerate(gts):
            uv, vis = np.array(g['uv'], float)[order], np.array(g['vis'])[order]
            size = max(np.linalg.norm(np.ptp(uv[vis > 0], axis=0)) / 2, 1.0)
            for b, xy in enumerate(people.xyz if hasattr(people, 'xyz') else people.xy):
                d = np.linalg.norm(xy - uv, axis=1)[vis > 0]
                if np.isfinite(d).any():
                    cost[a, b] = np.nanmedian(d) / size
        for a, b in zip(*linear_sum_assignment(np.minimum(cost, 1e3))) if cost.size else ():
            if cost[a, b] < 0.5:
                c['im_match'] += 1
                pid, gid = int(people.ids[b]), gts[a]['id']
                c['im_switches'] += last.get(gid, pid) != pid
                last[gid] = pid
    return c
