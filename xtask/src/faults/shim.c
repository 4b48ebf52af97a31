/* A file layer that breaks on purpose: loaded in front of the C library, it counts what a command does with the files below
 * one folder, writes that down, and lets an operation fail, do half of its work, or end the process.
 *
 * DMP_FAULTS_UNDER  the folder, without links in its path; all else is left alone
 * DMP_FAULTS_LOG    where operations are written down, a line each:
 *                   number, operation, inode, offset, length, fault, path, second path or kept link; tabs between them
 * DMP_FAULTS_KEEP   a folder on the same file system: files that lose their name get another there, so that it can be undone
 * DMP_FAULTS_MODE   none, once, full (from there on nothing can be written), broken (from there on nothing works), kill
 * DMP_FAULTS_AT     the number of the operation, from 1; for kill only those that change something count
 * DMP_FAULTS_DRAW   a number that says which of the faults that suit the operation it is
 *
 * Operations are system calls, so that what is called here is never counted. One at a time: what is written down is what
 * happened, in that order.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#define HALF (-1) /* a fault that is no error: half of what was asked is done */

enum mode { NONE, ONCE, FULL, BROKEN, KILL };

/* Its name; whether it changes the disk; whether it needs room there; the faults that suit it, ended by 0. */
struct kind {
    const char *name;
    int changes, fills;
    int faults[6];
};
static const struct kind OPEN = {"open", 0, 0, {EIO, EACCES, EMFILE}}, MAKE = {"make", 1, 1, {EIO, ENOSPC, EACCES, EMFILE}},
    READ = {"read", 0, 0, {EIO, HALF, EINTR}}, WRITE = {"write", 1, 1, {EIO, ENOSPC, HALF, EINTR}},
    SYNC = {"sync", 1, 1, {EIO, ENOSPC}}, CUT = {"cut", 1, 0, {EIO, ENOSPC}}, RENAME = {"rename", 1, 1, {EIO, ENOSPC, EACCES}},
    UNLINK = {"unlink", 1, 0, {EIO, EACCES}}, MKDIR = {"mkdir", 1, 1, {EIO, ENOSPC, EACCES}}, RMDIR = {"rmdir", 1, 0, {EIO, EACCES}},
    LIST = {"list", 0, 0, {EIO, EACCES, EMFILE}}, NEXT = {"next", 0, 0, {EIO}}, STAT = {"stat", 0, 0, {EIO, EACCES}},
    MAP = {"map", 0, 0, {ENOMEM}}, LOCK = {"lock", 0, 0, {ENOLCK}}, FOLLOW = {"follow", 0, 0, {EIO, EACCES}};

static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER;
static const char *under, *keep;
static int logged = -1;
static enum mode mode;
static unsigned long at, draw, count, kept;

__attribute__((constructor)) static void begin(void) {
    const char *log = getenv("DMP_FAULTS_LOG"), *text = getenv("DMP_FAULTS_MODE");
    const char *names[] = {"none", "once", "full", "broken", "kill"};
    under = getenv("DMP_FAULTS_UNDER");
    keep = getenv("DMP_FAULTS_KEEP");
    for (int k = 0; text && k < 5; k++)
        if (!strcmp(text, names[k])) mode = k;
    at = (text = getenv("DMP_FAULTS_AT")) ? strtoul(text, NULL, 10) : 0;
    draw = (text = getenv("DMP_FAULTS_DRAW")) ? strtoul(text, NULL, 10) : 0;
    if (log) logged = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
}

/* The path without `.`, `..` and doubled slashes; 0 where it is not one of ours. */
static int place_of(int folder, const char *path, char *out) {
    char whole[2 * PATH_MAX] = "", link[64];
    if (!under || !path) return 0;
    if (path[0] != '/') {
        ssize_t n;
        if (folder == AT_FDCWD) strcpy(link, "/proc/self/cwd");
        else if (folder <= 2) return 0;
        else snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
        n = syscall(SYS_readlinkat, AT_FDCWD, link, whole, PATH_MAX - 1);
        if (n <= 0) return 0;
        whole[n] = 0;
        if (path[0]) strcat(whole, "/");
    }
    if (strlen(path) >= PATH_MAX) return 0;
    strcat(whole, path);
    size_t end = 0;
    for (char *rest = whole, *part; (part = strsep(&rest, "/"));) {
        if (!*part || !strcmp(part, ".")) continue;
        if (!strcmp(part, "..")) {
            while (end && out[--end] != '/') {}
            continue;
        }
        out[end++] = '/';
        end = stpcpy(out + end, part) - out;
    }
    out[end] = 0;
    size_t n = strlen(under);
    return !strncmp(out, under, n) && (out[n] == '/' || !out[n]);
}

static void note(const struct kind *kind, long inode, long offset, long length, int fault, const char *a, const char *b) {
    char line[3 * PATH_MAX];
    if (logged < 0) return;
    int n = snprintf(line, sizeof line, "%lu\t%s\t%ld\t%ld\t%ld\t%d\t%s\t%s\n", count, kind->name, inode, offset, length, fault, a,
                     b ? b : "");
    syscall(SYS_write, logged, line, (size_t)n);
}

static void end(void) {
    syscall(SYS_kill, getpid(), SIGKILL);
    for (;;) pause();
}

/* What becomes of the next operation: 0, an error, or HALF. With kill it may not come back; HALF is then a write's last. */
static int fate(const struct kind *kind) {
    int faults = 0;
    if (mode == KILL && !kind->changes) return 0;
    if (++count < at || !at || mode == NONE) return 0;
    while (faults < 5 && kind->faults[faults]) faults++;
    if (count == at && mode == ONCE) return kind->faults[draw % faults];
    if (mode == BROKEN) return EIO;
    if (mode == FULL && kind->fills) return count == at && kind == &WRITE && draw % 2 ? HALF : ENOSPC;
    if (mode != KILL) return 0;
    if (kind == &WRITE && draw % 2) return HALF;
    end();
    return 0;
}

static long inode_of(int file, long *size) {
    struct stat found;
    if (syscall(SYS_newfstatat, file, "", &found, AT_EMPTY_PATH)) return 0;
    if (size) *size = found.st_size;
    return found.st_ino;
}

/* Gives a file that is to lose its name another one; where it is then. */
static const char *kept_link(const char *path, char *out) {
    struct stat found;
    if (!keep || syscall(SYS_newfstatat, AT_FDCWD, path, &found, AT_SYMLINK_NOFOLLOW) || S_ISDIR(found.st_mode)) return NULL;
    snprintf(out, PATH_MAX, "%s/%lu", keep, ++kept);
    return syscall(SYS_linkat, AT_FDCWD, path, AT_FDCWD, out, 0) ? NULL : out;
}

/* An operation on a path or an open file: its turn begins, and its fate is drawn; `END` ends it. */
#define BEGIN(what, folder, path) \
    char place[3 * PATH_MAX]; \
    int ours = place_of(folder, path, place), saved = 0, fault = 0; \
    long result; \
    const struct kind *of = what; \
    if (ours) { \
        pthread_mutex_lock(&turn); \
        fault = fate(of); \
    }
#define DO(call) \
    if (fault > 0) { \
        result = -1; \
        saved = fault; \
    } else { \
        result = (call); \
        saved = errno; \
    }
#define END(inode, offset, length, second) \
    if (ours) { \
        if (result >= 0 || fault) note(of, inode, offset, length, fault, place, second); \
        if (fault == HALF && mode == KILL) end(); \
        pthread_mutex_unlock(&turn); \
    } \
    errno = saved; \
    return result;

static int open_any(int folder, const char *path, int flags, mode_t rights) {
    int makes = flags & (O_CREAT | O_TRUNC) || (flags & O_TMPFILE) == O_TMPFILE;
    struct stat before;
    int was = !syscall(SYS_newfstatat, folder, path, &before, 0);
    long inode = 0, size = 0;
    BEGIN(makes ? &MAKE : &OPEN, folder, path)
    DO(syscall(SYS_openat, folder, path, flags, rights))
    if (ours && result >= 0) inode = inode_of(result, NULL);
    if (was && S_ISREG(before.st_mode)) size = before.st_size;
    /* The offset says what it did: 1 made the name, 2 cut what was there. */
    int unnamed = (flags & O_TMPFILE) == O_TMPFILE;
    END(inode, !unnamed && !was ? 1 : flags & O_TRUNC ? 2 : 0, size, unnamed ? "unnamed" : NULL)
}

#define OPEN_FUNCTION(name) \
    int name(const char *path, int flags, ...) { \
        va_list more; \
        va_start(more, flags); \
        mode_t rights = va_arg(more, mode_t); \
        va_end(more); \
        return open_any(AT_FDCWD, path, flags, rights); \
    }
#define OPENAT_FUNCTION(name) \
    int name(int folder, const char *path, int flags, ...) { \
        va_list more; \
        va_start(more, flags); \
        mode_t rights = va_arg(more, mode_t); \
        va_end(more); \
        return open_any(folder, path, flags, rights); \
    }
OPEN_FUNCTION(open)
OPEN_FUNCTION(open64)
OPENAT_FUNCTION(openat)
OPENAT_FUNCTION(openat64)

/* Half of what was asked, but at least a byte. */
static size_t part(size_t size, int fault) { return fault == HALF && size > 1 ? size / 2 : size; }
static long here(int file) { return syscall(SYS_lseek, file, 0L, SEEK_CUR); }

#define MOVES(what, file, call, offset) \
    BEGIN(what, file, "") \
    DO(call) \
    long inode = ours ? inode_of(file, NULL) : 0; \
    END(inode, offset, result, NULL)

ssize_t read(int file, void *to, size_t size) {
    MOVES(&READ, file, syscall(SYS_read, file, to, part(size, fault)), here(file) - result)
}
ssize_t write(int file, const void *from, size_t size) {
    MOVES(&WRITE, file, syscall(SYS_write, file, from, part(size, fault)), here(file) - result)
}
ssize_t pread64(int file, void *to, size_t size, off_t offset) {
    MOVES(&READ, file, syscall(SYS_pread64, file, to, part(size, fault), offset), offset)
}
ssize_t pread(int file, void *to, size_t size, off_t offset) { return pread64(file, to, size, offset); }
ssize_t pwrite64(int file, const void *from, size_t size, off_t offset) {
    MOVES(&WRITE, file, syscall(SYS_pwrite64, file, from, part(size, fault), offset), offset)
}
ssize_t pwrite(int file, const void *from, size_t size, off_t offset) { return pwrite64(file, from, size, offset); }
/* Of several pieces the first alone, where half is to be done. */
ssize_t readv(int file, const struct iovec *to, int pieces) {
    MOVES(&READ, file, syscall(SYS_readv, file, to, fault == HALF ? 1 : pieces), here(file) - result)
}
ssize_t writev(int file, const struct iovec *from, int pieces) {
    MOVES(&WRITE, file, syscall(SYS_writev, file, from, fault == HALF ? 1 : pieces), here(file) - result)
}

/* What is asked of an open file; the length is that of the file. */
#define ON_FILE(what, file, call) \
    BEGIN(what, file, "") \
    DO(call) \
    long size = 0, inode = ours ? inode_of(file, &size) : 0; \
    END(inode, 0, size, NULL)

int fsync(int file) { ON_FILE(&SYNC, file, syscall(SYS_fsync, file)) }
int fdatasync(int file) { ON_FILE(&SYNC, file, syscall(SYS_fdatasync, file)) }
int ftruncate64(int file, off_t size_asked) { ON_FILE(&CUT, file, syscall(SYS_ftruncate, file, size_asked)) }
int ftruncate(int file, off_t size) { return ftruncate64(file, size); }
int flock(int file, int how) {
    /* Giving a lock back does not fail. */
    if (how & LOCK_UN) return syscall(SYS_flock, file, how);
    ON_FILE(&LOCK, file, syscall(SYS_flock, file, how))
}
void *mmap64(void *where, size_t length, int rights, int flags, int file, off_t offset) {
    if (file < 0 || flags & MAP_ANONYMOUS) return (void *)syscall(SYS_mmap, where, length, rights, flags, file, offset);
    BEGIN(&MAP, file, "")
    long mapped = -1;
    DO((mapped = syscall(SYS_mmap, where, length, rights, flags, file, offset)) == -1 ? -1 : 0)
    if (ours) {
        note(of, inode_of(file, NULL), offset, length, fault, place, NULL);
        pthread_mutex_unlock(&turn);
    }
    errno = saved;
    (void)result;
    return (void *)mapped;
}

/* What changes names. */
static int rename_any(int from_folder, const char *from, int to_folder, const char *to, unsigned flags) {
    char second[3 * PATH_MAX] = "", link[PATH_MAX], both[4 * PATH_MAX];
    const char *old = NULL;
    BEGIN(&RENAME, from_folder, from)
    if (ours && !fault && place_of(to_folder, to, second)) old = kept_link(second, link);
    DO(syscall(SYS_renameat2, from_folder, from, to_folder, to, flags))
    snprintf(both, sizeof both, "%s\t%s", second, old ? old : "");
    END(0, 0, 0, both)
}
int rename(const char *from, const char *to) { return rename_any(AT_FDCWD, from, AT_FDCWD, to, 0); }
int renameat(int a, const char *from, int b, const char *to) { return rename_any(a, from, b, to, 0); }
int renameat2(int a, const char *from, int b, const char *to, unsigned flags) { return rename_any(a, from, b, to, flags); }

int unlinkat(int folder, const char *path, int flags) {
    char link[PATH_MAX];
    const char *old = NULL;
    BEGIN(flags & AT_REMOVEDIR ? &RMDIR : &UNLINK, folder, path)
    if (ours && !fault && !(flags & AT_REMOVEDIR)) old = kept_link(place, link);
    DO(syscall(SYS_unlinkat, folder, path, flags))
    END(0, 0, 0, old)
}
int unlink(const char *path) { return unlinkat(AT_FDCWD, path, 0); }
int rmdir(const char *path) { return unlinkat(AT_FDCWD, path, AT_REMOVEDIR); }
int mkdir(const char *path, mode_t rights) {
    BEGIN(&MKDIR, AT_FDCWD, path)
    DO(syscall(SYS_mkdirat, AT_FDCWD, path, rights))
    END(0, 0, 0, NULL)
}

/* What looks. */
#define LOOKS(what, folder, path, call) \
    BEGIN(what, folder, path) \
    DO(call) \
    END(0, 0, 0, NULL)

int fstatat64(int folder, const char *path, struct stat64 *found, int flags) {
    LOOKS(&STAT, folder, path, syscall(SYS_newfstatat, folder, path, found, flags))
}
int stat64(const char *path, struct stat64 *found) { return fstatat64(AT_FDCWD, path, found, 0); }
int lstat64(const char *path, struct stat64 *found) { return fstatat64(AT_FDCWD, path, found, AT_SYMLINK_NOFOLLOW); }
int fstat64(int file, struct stat64 *found) { return fstatat64(file, "", found, AT_EMPTY_PATH); }
int statx(int folder, const char *path, int flags, unsigned asked, struct statx *found) {
    LOOKS(&STAT, folder, path, syscall(SYS_statx, folder, path, flags, asked, found))
}
ssize_t readlink(const char *path, char *to, size_t size) {
    LOOKS(&FOLLOW, AT_FDCWD, path, syscall(SYS_readlinkat, AT_FDCWD, path, to, size))
}
DIR *opendir(const char *path) {
    DIR *(*real)(const char *) = (DIR * (*)(const char *)) dlsym(RTLD_NEXT, "opendir");
    DIR *opened = NULL;
    BEGIN(&LIST, AT_FDCWD, path)
    DO((opened = real(path)) ? 0 : -1)
    if (ours) {
        note(of, 0, 0, 0, fault, place, NULL);
        pthread_mutex_unlock(&turn);
    }
    errno = saved;
    (void)result;
    return opened;
}
struct dirent64 *readdir64(DIR *folder) {
    struct dirent64 *(*real)(DIR *) = (struct dirent64 * (*)(DIR *)) dlsym(RTLD_NEXT, "readdir64");
    struct dirent64 *found = NULL;
    /* The end shows in errno, which is to stay as it is. */
    int before = errno;
    BEGIN(&NEXT, dirfd(folder), "")
    errno = before;
    DO((found = real(folder)) ? 0 : -1)
    if (ours) {
        if (fault) note(of, 0, 0, 0, fault, place, NULL);
        pthread_mutex_unlock(&turn);
    }
    errno = saved;
    (void)result;
    return found;
}
