// Shards: ranges of runs that processes anywhere work off, each into a file of its own.
//
// runs.db.d/17 names the runs of shard 17. A worker appends to 17.part.<host>.<process> and, when all its
// runs are there, links that file to 17.done: link(2) succeeds once, so that of two workers on one shard (a
// scheduler that started it again) one wins and the other notices. What workers that died have left in their
// files is read, not computed again.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "store/record.hpp"

namespace pendula::store {

/// Runs first … last - 1, from 0.
using Ranges = std::vector<std::pair<long, long>>;

/// "1-20 35-40": counted from 1, ends included.
std::string ranges_text(const Ranges& ranges);
/// Throws Error where the text is something else.
Ranges read_ranges(const std::string& text);

/// The records of a shard's file, as far as they are whole. Throws Error where it belongs to another sweep.
std::vector<Record> read_shard(const std::string& file, const std::string& fingerprint);

class Shard : public RunSink {
 public:
  /// path: "runs.db.d/17". Opens a file for this process and takes over the results of processes that have
  /// ended. Throws Error where there is no such shard, the folder cannot be written.
  Shard(std::string path, std::string fingerprint, long runs);
  ~Shard() override;
  Shard(const Shard&) = delete;
  Shard& operator=(const Shard&) = delete;

  /// Somebody has finished it.
  bool is_done() const;
  long count() const;  ///< its runs
  long first() const { return ranges_.front().first; }
  long last() const { return ranges_.back().second; }
  void add(std::span<const Record> records) override;
  std::vector<bool> finished() const override;
  /// All its runs are there. False: another worker was first, and its file counts.
  bool finish();

 private:
  void take_over();
  std::string path_, fingerprint_, part_;
  Ranges ranges_;
  std::vector<bool> finished_;
  int file_ = -1;
};

}  // namespace pendula::store
