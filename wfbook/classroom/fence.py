"""What keeps an answer from anything but answering: Linux's seccomp and Landlock, and limits of resources.

Both work without a privilege and can't be undone by the process that took them on. An answer may compute,
start threads, read Python, wfbook and its assets, and write into one folder. It may start no process, send no
signal, open no connection, change no file elsewhere, and read neither chapters nor other answers.
"""

import ctypes
import os
import platform
import resource
import site
import struct
import sys
from pathlib import Path

import wfbook

_DENIED = {
    "processes": (57, 58, 59, 322),  # fork, vfork, execve, execveat
    "signals": (62, 129, 200, 234, 297, 424, 434),  # kill, rt_sigqueueinfo, tkill, tgkill, …, pidfd_open
    "others' memory": (101, 310, 311, 312, 438, 440, 448),  # ptrace, process_vm_*, kcmp, pidfd_getfd, …
    "connections": (41, 42, 49, 50),  # socket, connect, bind, listen
    "files' owners, modes, times": (
        *(76, 90, 91, 92, 93, 94, 132, 133, 188, 189, 190, 197, 198, 199),
        *(235, 259, 260, 261, 268, 280, 452),
    ),  # truncate, chmod, chown, utime, mknod, setxattr, removexattr and their relatives
    "memory that is counted nowhere": (29, 64, 68, 240, 319, 447),  # shmget, semget, msgget, mq_open, memfd_*
    "groups and priorities": (109, 112, 141, 142, 144, 203, 251, 314),  # setpgid, setsid, setpriority, …
    "the kernel": (
        *(103, 135, 153, 155, 159, 161, 163, 164, 165, 166, 167, 168, 169, 170, 171, 172, 173, 175, 176),
        *(179, 227, 246, 248, 249, 250, 256, 272, 279, 298, 303, 304, 305, 308, 313, 320, 321, 323),
        *(425, 426, 427, 428, 429, 430, 431, 432, 433, 442, 443),
    ),  # mount, unshare, setns, reboot, bpf, io_uring, perf, keys, modules, clocks and their relatives
}
"""System calls that are refused, by their numbers on x86-64."""

_CLONE, _CLONE3, _PRCTL, _PRLIMIT = 56, 435, 157, 302
_CLONE_THREAD, _PR_SET_PDEATHSIG = 0x10000, 1
_ARCHITECTURE, _X32 = 0xC000003E, 0x40000000
_KILL, _ALLOW, _ERRNO, _EPERM, _ENOSYS = 0x80000000, 0x7FFF0000, 0x50000, 1, 38
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER, _ARCH, _FIRST = 0, 4, 16  # offsets in seccomp_data
_PR_SET_NO_NEW_PRIVS, _PR_SET_SECCOMP, _SECCOMP_FILTER = 38, 22, 2

_CREATE_RULESET, _ADD_RULE, _RESTRICT = 444, 445, 446
_EXECUTE, _WRITE, _READ, _LIST = 1, 2, 4, 8
_RIGHTS = {1: 0x1FFF, 2: 0x3FFF, 3: 0x7FFF, 4: 0x7FFF, 5: 0xFFFF}
"""All rights over files that each version of Landlock knows."""
_OF_FILES = 0x1 | 0x2 | 0x4 | 0x4000 | 0x8000

_SYSTEM = (
    "/usr/lib",
    "/usr/lib64",
    "/usr/local/lib",
    "/usr/share/zoneinfo",
    "/lib",
    "/lib64",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/dev/urandom",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/sys/devices/system/cpu",
)

_libc = ctypes.CDLL(None, use_errno=True)


def missing() -> list[str]:
    """Return what this system lacks for a fence; empty if it has all."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return [f"seccomp and Landlock on {sys.platform} {platform.machine()}"]
    lacks = []
    action = ctypes.c_uint32(_ERRNO)
    if _libc.syscall(317, 2, 0, ctypes.byref(action)) != 0:
        lacks.append("seccomp")
    if _landlock_version() < 1:
        lacks.append("Landlock")
    return lacks


def readable() -> list[str]:
    """Return what an answer may read: Python, what is installed in it, and wfbook with its assets."""
    package = Path(wfbook.__file__).parent
    packages = [path for path in sys.path if path.endswith("-packages")]
    packages += [sys.prefix, sys.base_prefix, *site.getsitepackages()]
    ours = [*packages, package, package.parent / "assets"]
    return [str(path) for path in (*ours, *_SYSTEM) if os.path.exists(path)]


def limit(memory: int, seconds: int, file_size: int = 16 * 2**20) -> None:
    """Limit what this process may use.

    Args:
        memory: bytes, beyond what it has now.
        seconds: of processor time, from now on.
        file_size: bytes of each file.
    """
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + memory
    used = resource.getrusage(resource.RUSAGE_SELF)
    until = int(used.ru_utime + used.ru_stime) + seconds + 1
    for kind, value in (
        (resource.RLIMIT_AS, most),
        (resource.RLIMIT_CPU, until),
        (resource.RLIMIT_FSIZE, file_size),
        (resource.RLIMIT_NOFILE, 64),
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(kind, (value, value))


def die_with_parent() -> None:
    """Have the kernel end this process when the one that started it ends."""
    if sys.platform == "linux":
        _libc.prctl(_PR_SET_PDEATHSIG, 9, 0, 0, 0)


def close(writable: Path) -> None:
    """Fence this process in, for good.

    Args:
        writable: the only folder where it may write.

    Raises:
        OSError: the system refuses.
    """
    _must(_libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))
    _restrict_files(writable)
    _restrict_calls()


def _restrict_files(writable: Path) -> None:
    version = _landlock_version()
    rights = _RIGHTS[max(1, min(version, 5))]
    content = struct.pack("QQQ", rights, 3 if version >= 4 else 0, 3 if version >= 6 else 0)
    size = 8 if version < 4 else 16 if version < 6 else 24
    ruleset = _must(_libc.syscall(_CREATE_RULESET, content, size, 0))
    places = [(path, _EXECUTE | _READ | _LIST) for path in readable()]
    places += [(str(writable), rights & ~_EXECUTE), ("/dev/null", _READ | _WRITE)]
    for path, allowed in places:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
        if not os.path.isdir(path):
            allowed &= _OF_FILES
        rule = struct.pack("=Qi", allowed & rights, place)
        _must(_libc.syscall(_ADD_RULE, ruleset, 1, rule, 0))
        os.close(place)
    _must(_libc.syscall(_RESTRICT, ruleset, 0))
    os.close(ruleset)


def _restrict_calls() -> None:
    program = [
        (_LOAD, 0, 0, _ARCH),
        (_EQUAL, 1, 0, _ARCHITECTURE),
        (_RETURN, 0, 0, _KILL),
        (_LOAD, 0, 0, _NUMBER),
        (_AT_LEAST, 0, 1, _X32),
        (_RETURN, 0, 0, _KILL),
        (_EQUAL, 0, 1, _CLONE3),  # glibc then falls back on clone, whose flags can be seen
        (_RETURN, 0, 0, _ERRNO | _ENOSYS),
    ]
    # Each of these looks at its first argument: threads yes, processes no; one's own limits only.
    for number, jump, value, yes in (
        (_CLONE, _ANY_BIT, _CLONE_THREAD, _ALLOW),
        (_PRLIMIT, _EQUAL, 0, _ALLOW),
        (_PRCTL, _EQUAL, _PR_SET_PDEATHSIG, _ERRNO | _EPERM),
    ):
        no = _ERRNO | _EPERM if yes == _ALLOW else _ALLOW
        program += [
            (_EQUAL, 0, 4, number),
            (_LOAD, 0, 0, _FIRST),
            (jump, 0, 1, value),
            (_RETURN, 0, 0, yes),
            (_RETURN, 0, 0, no),
        ]
    for number in sorted({number for group in _DENIED.values() for number in group}):
        program += [(_EQUAL, 0, 1, number), (_RETURN, 0, 0, _ERRNO | _EPERM)]
    program.append((_RETURN, 0, 0, _ALLOW))
    code = b"".join(struct.pack("HBBI", *instruction) for instruction in program)
    buffer = ctypes.create_string_buffer(code)
    header = struct.pack("HxxxxxxP", len(program), ctypes.addressof(buffer))
    _must(_libc.prctl(_PR_SET_SECCOMP, _SECCOMP_FILTER, header, 0, 0))


def _landlock_version() -> int:
    return _libc.syscall(_CREATE_RULESET, None, 0, 1)


def _must(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return result
