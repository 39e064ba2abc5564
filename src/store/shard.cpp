#include "store/shard.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include "base/error.hpp"

namespace pendula::store {
namespace {

constexpr const char* magic = "pendula shard 1\n";

template <class T>
void put(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put_numbers(std::string& to, const std::vector<double>& numbers) {
  put(to, static_cast<std::uint32_t>(numbers.size()));
  to.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double));
}

std::uint32_t check_sum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

/// A record as bytes: length, check sum, contents.
std::string framed(const Record& r) {
  std::string contents;
  put(contents, static_cast<std::int64_t>(r.run));
  put(contents, static_cast<std::uint32_t>(r.done));
  put_numbers(contents, r.varied);
  put_numbers(contents, r.numbers);
  contents += r.why;
  std::string frame;
  put(frame, static_cast<std::uint32_t>(contents.size()));
  put(frame, check_sum(contents));
  return frame + contents;
}

/// Takes values from the front of a byte string; `good` becomes false if there are too few bytes.
struct Reader {
  std::string_view bytes;
  bool good = true;
  template <class T>
  T take() {
    T value{};
    good = good && bytes.size() >= sizeof value;
    if (!good) return value;
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return value;
  }
  std::vector<double> take_numbers() {
    const auto count = take<std::uint32_t>();
    good = good && bytes.size() / sizeof(double) >= count;
    std::vector<double> numbers(good ? count : 0);
    if (good && count > 0) std::memcpy(numbers.data(), bytes.data(), count * sizeof(double));
    if (good) bytes.remove_prefix(count * sizeof(double));
    return numbers;
  }
};

bool take_record(Reader& reader, Record& r) {
  const auto size = reader.take<std::uint32_t>();
  const auto sum = reader.take<std::uint32_t>();
  if (!reader.good || reader.bytes.size() < size) return false;
  Reader inner{reader.bytes.substr(0, size)};
  if (check_sum(inner.bytes) != sum) return false;
  r.run = static_cast<long>(inner.take<std::int64_t>());
  r.done = inner.take<std::uint32_t>() != 0;
  r.varied = inner.take_numbers();
  r.numbers = inner.take_numbers();
  r.why = std::string(inner.bytes);
  reader.bytes.remove_prefix(size);
  return inner.good;
}

std::string contents_of(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  if (!file) throw Error("cannot read '" + name + "'");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Writes all bytes or throws Failure.
void write_all(int file, const std::string& bytes, const std::string& name) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = write(file, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      throw Failure("cannot write '" + name + "': " + std::strerror(errno) +
                    "; what was written before is kept");
    at += static_cast<std::size_t>(written);
  }
}

}  // namespace

std::string ranges_text(const Ranges& ranges) {
  std::string result;
  for (const auto& [first, last] : ranges)
    result += (result.empty() ? "" : " ") + std::to_string(first + 1) + "-" + std::to_string(last);
  return result;
}

Ranges read_ranges(const std::string& text) {
  Ranges ranges;
  std::istringstream in(text);
  for (std::string word; in >> word;) {
    long first = 0, last = 0;
    char dash = 0;
    std::istringstream parts(word);
    if (!(parts >> first >> dash >> last) || parts.get() != EOF || dash != '-' || first < 1 || last < first)
      throw Error("'" + word + "' is not a range of runs such as 1-20");
    ranges.emplace_back(first - 1, last);
  }
  if (ranges.empty()) throw Error("it names no runs");
  return ranges;
}

std::vector<Record> read_shard(const std::string& file, const std::string& fingerprint) {
  const std::string bytes = contents_of(file), head = magic + fingerprint + "\n";
  // the process that wrote it ended before the header was complete
  if (bytes.size() < head.size()) return {};
  if (bytes.compare(0, head.size(), head) != 0)
    throw Error("'" + file + "' belongs to another sweep; remove it, or the folder that it is in");
  std::vector<Record> records;
  Reader reader{std::string_view(bytes).substr(head.size())};
  for (Record r; take_record(reader, r);) records.push_back(r);
  return records;
}

Shard::Shard(std::string path, std::string fingerprint, long runs)
    : path_(std::move(path)),
      fingerprint_(std::move(fingerprint)),
      finished_(static_cast<std::size_t>(runs), true) {
  try {
    ranges_ = read_ranges(contents_of(path_));
    if (last() > runs) throw Error("it names runs that the sweep does not have");
  } catch (const Error& e) {
    throw Error("there is no shard '" + path_ + "': " + e.what());
  }
  for (const auto& [from, to] : ranges_)
    for (long run = from; run < to; ++run) finished_[run] = false;
  if (is_done()) return;
  char host[256] = "host";
  gethostname(host, sizeof host - 1);
  part_ = path_ + ".part." + host + "." + std::to_string(getpid());
  file_ = open(part_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0) throw Error("cannot write '" + part_ + "': " + std::strerror(errno));
  write_all(file_, magic + fingerprint_ + "\n", part_);
  take_over();
}

Shard::~Shard() {
  if (file_ >= 0) close(file_);
}

/// Collects records left by other workers on this shard; their files stay until the shard is collected.
void Shard::take_over() {
  namespace fs = std::filesystem;
  const fs::path own(part_);
  const std::string begin = fs::path(path_).filename().string() + ".part.";
  const fs::path folder = own.has_parent_path() ? own.parent_path() : ".";
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.compare(0, begin.size(), begin) != 0 || name == own.filename().string()) continue;
    std::vector<Record> found;
    for (Record& r : read_shard(entry.path().string(), fingerprint_)) {
      const bool wanted = r.run >= 0 && r.run < static_cast<long>(finished_.size()) && !finished_[r.run];
      if (!wanted) continue;
      finished_[r.run] = true;
      found.push_back(std::move(r));
    }
    add(found);
  }
}

bool Shard::is_done() const { return access((path_ + ".done").c_str(), F_OK) == 0; }

long Shard::count() const {
  long count = 0;
  for (const auto& [from, to] : ranges_) count += to - from;
  return count;
}

void Shard::add(std::span<const Record> records) {
  std::string bytes;
  for (const Record& r : records) bytes += framed(r);
  if (bytes.empty()) return;
  write_all(file_, bytes, part_);
  fdatasync(file_);
}

std::vector<bool> Shard::finished() const { return finished_; }

bool Shard::finish() {
  if (file_ < 0) return false;
  if (fsync(file_) != 0) throw Failure("cannot write '" + part_ + "': " + std::strerror(errno));
  const bool first = link(part_.c_str(), (path_ + ".done").c_str()) == 0;
  if (!first && errno != EEXIST)
    throw Failure("cannot link '" + part_ + "' to '" + path_ + ".done': " + std::strerror(errno));
  unlink(part_.c_str());
  return first;
}

}  // namespace pendula::store
