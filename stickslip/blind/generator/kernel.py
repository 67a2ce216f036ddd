"""The compiled time loop: leapfrog with the return map; implicit steps while nothing but creep happens."""

from __future__ import annotations

import math

import numpy as np

from . import array_layout as S
from .compiled import jit
from .contacts import contacts, forget, fresh_lines, needs_rich, new_life, relax
from .implicit import creep_step, kick
from .laws import advance, body_force, damping, friction, load_point, rated, spring_force
from .springs import Springs, stored

QUIET_BELOW = 0.7e-6  # m/s: creep slower than this ...
QUIET_AFTER = 8e-3  # s: ... for this long is followed with implicit steps
QUIET_UNTIL = 1e-6  # m/s: left above this; at 3 um/s every event came 0.1 ms late
QUIET_STIFFNESS = 8.0  # sticking stiffness over the rate of weakening: nearer to one, creep begins to oscillate
SMALLEST_SLIP = 3e-6  # m: less is a lurch of the springs, not a slip


@jit
def run(
    rig, eff, normal_pool, k_pool, count_pool, start, tau, times, positions, dt, record_dt,
    quiet_allowed, quiet_dt, renew, onset_velocity, rng, stop_events, stop_tail, record, events,
):  # fmt: skip
    """Integrate until ``record`` is full, and fill it (samples, RECORD_SIZE) and ``events`` (max, 7).

    After ``stop_events`` slips it goes on for ``stop_tail`` of the last interval and ends.
    Returns the number of events, of steps, of implicit steps and of samples.
    """
    size = normal_pool.shape[1]
    k = k_pool[0]
    normal = normal_pool[0]
    row = 0
    f = np.zeros((4, size))
    g = np.zeros((4, size))
    fade = np.ones(size)
    fade_step = 0.0
    is_rich = needs_rich(eff)
    springs = Springs(k, normal, fade, start, is_rich, eff)
    is_rated = rated(eff)
    if eff[S.RENEW_RATE] != 0.0:
        for i in range(size):
            life = new_life(eff, rng)
            f[3, i] = life if eff[S.RENEW_FORM] == 0.0 else life * rng.random()
    state = np.zeros(S.STATE_SIZE)
    state[S.PSI] = 1.0
    state[S.AGE] = eff[S.AGE_START]
    state[S.REST] = 0.0
    trial = state.copy()

    mass = rig[S.MASS]
    capacity = rig[S.MU_S] * normal_pool[0].sum()
    yaw_on = eff[S.YAW_EPS] != 0.0
    yaw_mass = 0.4 * mass
    yaw_w = 2.0 * math.pi * eff[S.YAW_F]
    k_m = 1.0 / eff[S.COMPLIANCE] if eff[S.COMPLIANCE] != 0.0 else 0.0
    quiet_allowed = quiet_allowed and not yaw_on

    t = 0.0
    x = 0.0
    u = 0.0  # displacement of the contact; x unless the fixture gives
    vh = 0.0
    v = 0.0
    q = 0.0
    qh = 0.0
    z = load_point(0.0, times, positions, eff)
    y = z - x
    soft = 1.0
    fs, branch = spring_force(y, y, 0.0, 0.0, dt, rig, eff)
    fc = 0.0
    moment = 0.0
    stiff = k.sum()
    c_now = rig[S.DAMPING]
    fb = body_force(0.0, 0.0, 0.0, rig, eff)

    work_drive = 0.0
    work_spring = 0.0
    work_contact = 0.0
    work_viscous = 0.0
    work_body = 0.0
    yaw_energy = 0.0

    quiet_stiffness = QUIET_STIFFNESS * (rig[S.MU_S] - rig[S.MU_K]) / rig[S.MU_S] * capacity / rig[S.SLIP_LENGTH]
    calm = 0.0
    quiet = False
    sliding = False
    n_events = 0
    n_steps = 0
    n_quiet = 0
    n_samples = record.shape[0]
    sample = 0
    lost = 0.0  # elastic energy that left the books when springs were replaced

    while sample < n_samples:
        # the record, by interpolation over the last step, is written at the end of the loop; sample 0 is the start
        if sample == 0:
            record[0, :] = 0.0
            record[0, 2] = z
            record[0, 3] = fs
            record[0, 5] = 1.0
            sample = 1
            continue
        t0, x0, v0, z0, y0, fs0, fc0, psi0, u0, q0 = t, x, v, z, y, fs, fc, state[S.PSI], u, q
        wd0, ws0, wc0, wv0, wb0 = work_drive, work_spring, work_contact, work_viscous, work_body
        c0, fb0, stiff0 = c_now, fb, stiff
        power = abs(fc0 * v0)
        n_steps += 1

        done = False
        if quiet:
            h = quiet_dt
            for i in range(times.size):  # land on the corners of the drive
                if times[i] > t0 + 1e-3 * dt and times[i] < t0 + h:
                    h = times[i] - t0
            t1 = t0 + h
            z1 = load_point(t1, times, positions, eff)
            if is_rich and h != fade_step:
                fade_step = relax(fade, tau, h, eff)
            done, du, x, v, y, fs, br, fc, moment, stiff, c_now, fb = creep_step(
                f, g, springs, soft, state, trial, rig,
                t1, h, z1, x0, u0, v0, y0, fs0, branch, power, capacity, k_m, QUIET_UNTIL,
            )  # fmt: skip
            done = done and stiff >= quiet_stiffness
            if done:
                n_quiet += 1
                t = t1
                z = z1
                branch = br
                u = u0 + du
                vh = v
                dx = x - x0
                work_viscous += 0.5 * (c0 * v0 + c_now * v) * dx
                work_body += 0.5 * (fb0 + fb) * dx
            else:  # too fast: take the step again with small ones
                quiet = False
                calm = 0.0
                t, x, v, y, fs, fc, c_now, fb, stiff = t0, x0, v0, y0, fs0, fc0, c0, fb0, stiff0
        if not done:
            h = dt
            t = t0 + h
            if is_rich and h != fade_step:
                fade_step = relax(fade, tau, h, eff)
            x = x0 + h * vh
            z = load_point(t, times, positions, eff)
            y = z - x
            fs, branch = spring_force(y, y0, branch, t, h, rig, eff)
            du = h * vh
            if k_m != 0.0:
                du = (k_m * (x - u0) - fc0) / (k_m + stiff)
            u = u0 + du
            dq = h * qh
            q = q0 + dq
            advance(state, trial, du / h, h, rig, eff, power)
            mu = friction(trial, t, x, rig, eff)
            tilt = 0.0
            if eff[S.TILT_K] != 0.0:
                tilt = eff[S.TILT_K] * fs / capacity
            c_now = damping(vh, stiff, fc0 / capacity, rig, eff)
            fb = body_force(t, x, vh, rig, eff)
            if not is_rated:
                fc, moment, stiff = contacts(f, g, springs, du, dq, h, mu, mu, soft, tilt)
                before = vh
                vh = ((mass / h - 0.5 * c_now) * vh + fs - fc + fb) / (mass / h + 0.5 * c_now)
                v = 0.5 * (before + vh)
            else:
                v, fc, moment, stiff = kick(
                    f, g, springs, soft, trial, rig,
                    du, dq, h, mu, tilt, fs, fb, c_now, v0, vh,
                )  # fmt: skip
                vh = 2.0 * v - vh
            work_viscous += 0.5 * h * (c0 * v0 * v0 + c_now * v * v)
            work_body += 0.5 * h * (fb0 * v0 + fb * v)
            if yaw_on:
                c_y = 2.0 * eff[S.YAW_ZETA] * yaw_mass * yaw_w
                pull = eff[S.YAW_EPS] * fs - moment - yaw_mass * yaw_w * yaw_w * q
                before = qh
                qh = ((yaw_mass / h - 0.5 * c_y) * qh + pull) / (yaw_mass / h + 0.5 * c_y)
                rate = 0.5 * (before + qh)
                work_viscous += c_y * rate * rate * h
                work_contact += moment * rate * h
                work_body += eff[S.YAW_EPS] * fs * rate * h
                yaw_energy = 0.5 * yaw_mass * (rate * rate + yaw_w * yaw_w * q * q)

        # commit
        f, g = g, f
        for i in range(S.STATE_SIZE):
            state[i] = trial[i]
        if eff[S.RENEW_RATE] != 0.0:
            for i in range(size):
                if f[3, i] <= 0.0:
                    f[3, i] = new_life(eff, rng)
        mean_s = 0.5 * (fs0 + fs)
        work_drive += mean_s * (z - z0)
        work_spring += mean_s * (y - y0)
        work_contact += 0.5 * (fc0 + fc) * (x - x0)
        if not (abs(v) < 1e3):
            return -1, n_steps, n_quiet, sample

        # record
        energy_known = False
        in_contact = 0.0
        while sample < n_samples and sample * record_dt <= t + 1e-3 * dt:
            w = (sample * record_dt - t0) / (t - t0)
            w = min(1.0, max(0.0, w))
            if not energy_known:
                in_contact = stored(f, k, size, soft, eff)
                if k_m != 0.0:
                    in_contact += 0.5 * fc * fc / k_m
                energy_known = True
            vs = v0 + w * (v - v0)
            record[sample, 0] = x0 + w * (x - x0)
            record[sample, 1] = vs
            record[sample, 2] = z0 + w * (z - z0)
            record[sample, 3] = fs0 + w * (fs - fs0)
            record[sample, 4] = fc0 + w * (fc - fc0)
            record[sample, 5] = psi0 + w * (state[S.PSI] - psi0)
            record[sample, 6] = 0.5 * mass * vs * vs + yaw_energy
            record[sample, 7] = ws0 + w * (work_spring - ws0)
            record[sample, 8] = in_contact - lost
            record[sample, 9] = wc0 + w * (work_contact - wc0)
            record[sample, 10] = wv0 + w * (work_viscous - wv0)
            record[sample, 11] = wd0 + w * (work_drive - wd0)
            record[sample, 12] = wb0 + w * (work_body - wb0)
            record[sample, 13] = q0 + w * (q - q0)
            sample += 1

        # events
        if not sliding and v > onset_velocity:
            sliding = True
            at = min(n_events, events.shape[0] - 1)
            w = (onset_velocity - v0) / (v - v0) if v > v0 else 1.0
            w = min(1.0, max(0.0, w))
            events[at, 0] = t0 + w * (t - t0)
            events[at, 2] = x0 + w * (x - x0)
            events[at, 4] = v
            events[at, 5] = fs
        elif sliding:
            at = min(n_events, events.shape[0] - 1)
            events[at, 4] = max(v, events[at, 4])
            if v <= 0.0:
                sliding = False
                w = v0 / (v0 - v) if v0 > v else 1.0
                at = min(n_events, events.shape[0] - 1)
                events[at, 1] = t0 + w * (t - t0)
                events[at, 3] = x0 + w * (x - x0)
                events[at, 6] = fs
                if events[at, 3] - events[at, 2] < SMALLEST_SLIP:
                    continue
                n_events += 1
                if n_events == stop_events:
                    last = events[n_events - 2, 1] if n_events > 1 else 0.0
                    n_samples = min(n_samples, int((t + stop_tail * (t - last)) / record_dt) + 1)
                before = stored(f, k, size, soft, eff)
                changed = False
                if renew:
                    nxt = n_events % normal_pool.shape[0]
                    f = fresh_lines(f, normal, normal_pool[nxt], count_pool[row], count_pool[nxt], start)
                    row = nxt
                    normal = normal_pool[row]
                    k = k_pool[row]
                    springs = Springs(k, normal, fade, start, is_rich, eff)
                    changed = True
                for i in range(size):
                    f[2, i] = 0.0
                if eff[S.RESIDUAL_EPS] != 0.0:
                    fc = forget(f, eff, rng)
                    changed = True
                if eff[S.WEAR_EPS] != 0.0 and eff[S.WEAR_FORM] == 3.0:
                    soft = 1.0 / (1.0 + eff[S.WEAR_EPS] * n_events)
                    changed = True
                if changed:
                    lost += stored(f, k, size, soft, eff) - before
        # quiet?
        calm = calm + (t - t0) if abs(v) < QUIET_BELOW else 0.0
        if quiet_allowed and not sliding and calm > QUIET_AFTER:
            quiet = stiff > quiet_stiffness
    return n_events, n_steps, n_quiet, sample
