// SQLite with its calls as objects and its errors as exceptions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace pendula::store {

class Database {
 public:
  /// Throws Error: the folder cannot be written, the file is no database.
  Database(const std::string& file, bool may_create);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  const std::string& file() const { return file_; }
  void run(const std::string& sql);
  /// Throws what an unsuccessful call means to the user: full disk, read-only, damaged, …
  [[noreturn]] void fail(const std::string& doing) const;
  sqlite3* handle() const { return handle_; }

 private:
  std::string file_;
  sqlite3* handle_ = nullptr;
};

class Statement {
 public:
  Statement(Database& database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// Columns and places are counted from 0 here.
  void bind(int place, std::int64_t value);
  void bind(int place, double value);  ///< NaN becomes NULL
  void bind(int place, std::string_view text);
  void bind_blob(int place, const void* bytes, std::size_t size);
  /// The next row; false: there is none, and the statement can be bound anew.
  bool step();
  std::int64_t integer(int column) const;
  double number(int column) const;  ///< NULL becomes NaN
  std::string text(int column) const;
  std::string_view blob(int column) const;  ///< until the next step

 private:
  Database& database_;
  sqlite3_stmt* statement_ = nullptr;
};

/// All or nothing: rolled back unless commit() was reached.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace pendula::store
