#include "store/database.hpp"

#include <cmath>
#include <filesystem>
#include <limits>

#include <sqlite3.h>
#include <sys/vfs.h>

#include "base/error.hpp"

namespace pendula::store {
namespace {

/// Write-ahead logs need memory shared between processes, which network file systems do not have.
bool is_on_network(const std::string& file) {
  struct statfs system {};
  const auto slash = file.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : slash == 0 ? "/" : file.substr(0, slash);
  if (statfs(folder.c_str(), &system) != 0) return false;
  switch (static_cast<unsigned long>(system.f_type)) {
    case 0x6969:      // NFS
    case 0xFF534D42:  // CIFS
    case 0xFE534D42:  // SMB2
    case 0x517B:      // SMB
    case 0x0BD00BD0:  // Lustre
    case 0x47504653:  // GPFS
    case 0x19830326:  // BeeGFS
    case 0x65735546:  // FUSE
      return true;
    default:
      return false;
  }
}

/// Opening a pipe would block SQLite until another process writes to it.
void require_regular(const std::string& file) {
  std::error_code ignored;
  const auto kind = std::filesystem::status(file, ignored).type();
  if (kind != std::filesystem::file_type::regular && kind != std::filesystem::file_type::not_found &&
      kind != std::filesystem::file_type::none)
    throw Error("cannot open '" + file +
                "': it is a folder, a pipe or a device, and runs are kept in a file");
}

}  // namespace

Database::Database(const std::string& file, bool may_create) : file_(file) {
  require_regular(file);
  const int flags = SQLITE_OPEN_READWRITE | (may_create ? SQLITE_OPEN_CREATE : 0);
  int status = sqlite3_open_v2(file.c_str(), &handle_, flags, nullptr);
  if (status != SQLITE_OK && !may_create) {
    sqlite3_close_v2(handle_);
    status = sqlite3_open_v2(file.c_str(), &handle_, SQLITE_OPEN_READONLY, nullptr);
  }
  try {
    if (status != SQLITE_OK) fail("open");
    sqlite3_busy_timeout(handle_, 10'000);
    if (sqlite3_db_readonly(handle_, "main") == 0 && may_create) {
      run(is_on_network(file) ? "PRAGMA journal_mode = DELETE" : "PRAGMA journal_mode = WAL");
      run("PRAGMA synchronous = NORMAL");
    }
  } catch (...) {
    sqlite3_close_v2(handle_);
    throw;
  }
}

Database::~Database() { sqlite3_close_v2(handle_); }

void Database::fail(const std::string& doing) const {
  const int code = handle_ ? sqlite3_errcode(handle_) : SQLITE_NOMEM;
  const std::string what = "'" + file_ + "'";
  switch (code & 0xff) {
    case SQLITE_FULL:
    case SQLITE_IOERR:
      throw Failure("cannot write " + what + ": the disk is full or failed (" + sqlite3_errmsg(handle_) +
                    "); what was written before is kept. Make room and give the same call again");
    case SQLITE_READONLY:
    case SQLITE_PERM:
      throw Error("cannot write " + what + ": the file or its folder is read-only");
    case SQLITE_CANTOPEN:
      throw Error("cannot " + doing + " " + what +
                  ": there is no such file or folder, or it may not be used");
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      throw Error(what + " is not a store of runs, or it is damaged; give store another name");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw Error(what + " is being used by another program; wait until it is done");
    default:
      throw Failure("cannot " + doing + " " + what + ": " +
                    (handle_ ? sqlite3_errmsg(handle_) : "no memory"));
  }
}

void Database::run(const std::string& sql) {
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail("use");
}

Statement::Statement(Database& database, const std::string& sql) : database_(database) {
  if (sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK)
    database.fail("read");
}
Statement::~Statement() { sqlite3_finalize(statement_); }

void Statement::bind(int place, std::int64_t value) { sqlite3_bind_int64(statement_, place + 1, value); }
void Statement::bind(int place, double value) { sqlite3_bind_double(statement_, place + 1, value); }
void Statement::bind(int place, std::string_view text) {
  sqlite3_bind_text(statement_, place + 1, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
}
void Statement::bind_blob(int place, const void* bytes, std::size_t size) {
  sqlite3_bind_blob64(statement_, place + 1, bytes, size, SQLITE_TRANSIENT);
}

bool Statement::step() {
  const int status = sqlite3_step(statement_);
  if (status == SQLITE_ROW) return true;
  if (status != SQLITE_DONE) database_.fail("use");
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
  return false;
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_, column); }
double Statement::number(int column) const {
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::numeric_limits<double>::quiet_NaN();
  return sqlite3_column_double(statement_, column);
}
std::string Statement::text(int column) const {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return bytes ? std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))) : "";
}
std::string_view Statement::blob(int column) const {
  const void* bytes = sqlite3_column_blob(statement_, column);
  return {static_cast<const char*>(bytes),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

Transaction::Transaction(Database& database) : database_(database) { database_.run("BEGIN IMMEDIATE"); }
Transaction::~Transaction() {
  if (open_) sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}
void Transaction::commit() {
  database_.run("COMMIT");
  open_ = false;
}

}  // namespace pendula::store
