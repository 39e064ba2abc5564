// A library to be preloaded (LD_PRELOAD): call number FAIL_AT of one kind fails, once or, with FAIL_ON=1, for
// good. FAIL_CALL is alloc, write, open, mmap, fork or rename. Calls count from main() on. Without FAIL_AT
// nothing fails; with FAIL_COUNT=file the number of calls is written there at the end.
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace {

long count = 0, fail_at = 0;
bool counting = false, for_good = false;
char kind = 0;  ///< the first letter of FAIL_CALL
const char* count_file = nullptr;
int (*real_main)(int, char**, char**);

/// Whether this call of kind k is to fail.
bool fails(char k) {
  if (!counting || k != kind) return false;
  ++count;
  return fail_at > 0 && (count == fail_at || (for_good && count > fail_at));
}

template <class F>
F* real(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

void write_count() {
  counting = false;
  if (FILE* file = std::fopen(count_file, "w")) {
    std::fprintf(file, "%ld\n", count);
    std::fclose(file);
  }
}

int counted_main(int argc, char** argv, char** environment) {
  if (const char* call = std::getenv("FAIL_CALL")) kind = call[0];
  if (const char* at = std::getenv("FAIL_AT")) fail_at = std::atol(at);
  for_good = std::getenv("FAIL_ON") != nullptr;
  count_file = std::getenv("FAIL_COUNT");
  if (count_file) std::atexit(write_count);
  unsetenv("LD_PRELOAD");  // what the program starts is not our business
  counting = true;
  return real_main(argc, argv, environment);
}

}  // namespace

extern "C" {

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);

using Main = int(int, char**, char**);
int __libc_start_main(Main* main, int argc, char** argv, void (*init)(), void (*fini)(), void (*end)(),
                      void* stack) {
  real_main = main;
  return real<int(Main*, int, char**, void (*)(), void (*)(), void (*)(), void*)>("__libc_start_main")(
      counted_main, argc, argv, init, fini, end, stack);
}

void* malloc(size_t size) {
  if (fails('a')) return errno = ENOMEM, nullptr;
  return __libc_malloc(size);
}
void* calloc(size_t n, size_t size) {
  if (fails('a')) return errno = ENOMEM, nullptr;
  return __libc_calloc(n, size);
}
void* realloc(void* old, size_t size) {
  if (size > 0 && fails('a')) return errno = ENOMEM, nullptr;
  return __libc_realloc(old, size);
}
ssize_t write(int file, const void* bytes, size_t size) {
  if (file > 2 && fails('w')) return errno = ENOSPC, -1;
  return real<ssize_t(int, const void*, size_t)>("write")(file, bytes, size);
}
ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t at) {  // SQLite
  if (fails('w')) return errno = ENOSPC, -1;
  return real<ssize_t(int, const void*, size_t, off64_t)>("pwrite64")(file, bytes, size, at);
}
int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int mode = flags & O_CREAT ? va_arg(rest, int) : 0;
  va_end(rest);
  if (fails('o')) return errno = EMFILE, -1;
  return real<int(const char*, int, ...)>("open")(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const int mode = flags & O_CREAT ? va_arg(rest, int) : 0;
  va_end(rest);
  if (fails('o')) return errno = EMFILE, -1;
  return real<int(const char*, int, ...)>("open64")(path, flags, mode);
}
void* mmap(void* at, size_t size, int protection, int flags, int file, off_t offset) {
  if (fails('m')) return errno = ENOMEM, MAP_FAILED;
  return real<void*(void*, size_t, int, int, int, off_t)>("mmap")(at, size, protection, flags, file, offset);
}
pid_t fork() {
  if (fails('f')) return errno = EAGAIN, -1;
  return real<pid_t()>("fork")();
}
int rename(const char* from, const char* to) {
  if (fails('r')) return errno = EIO, -1;
  return real<int(const char*, const char*)>("rename")(from, to);
}

}  // extern "C"
