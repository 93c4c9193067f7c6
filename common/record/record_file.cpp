#include "common/record/record_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/thread_name.h"

namespace strandcast {

Result<std::unique_ptr<RecordFile>> RecordFile::make(const std::filesystem::path& path,
                                                     IfPresent if_present) {
  constexpr mode_t kMode = 0640;  // who connected is in it
  int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
  const bool is_new = file >= 0;
  if (!is_new && errno == EEXIST) {
    if (if_present == IfPresent::Refuse)
      return at(path.string(), make_error(ErrorCode::BadInput,
                                          "the file is there already: name another one, or say "
                                          "--record-replace"));
    file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  }
  if (file < 0)
    return at(path.string(), make_error(ErrorCode::NotFound, "cannot be written: {}", std::strerror(errno)));
  struct stat info {};
  if (::fstat(file, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(file);
    return at(path.string(), make_error(ErrorCode::BadInput, "not a regular file"));
  }
  return std::unique_ptr<RecordFile>(new RecordFile(file, path, is_new));
}

RecordFile::RecordFile(int file, std::filesystem::path path, bool is_new)
    : file_(file), path_(std::move(path)), is_new_(is_new) {}

RecordFile::~RecordFile() {
  finish();
  ::close(file_);
  if (!is_kept_ && is_new_) ::unlink(path_.c_str());
}

void RecordFile::keep() {
  is_kept_ = true;
  if (::ftruncate(file_, 0) != 0) {
    const std::lock_guard lock(mutex_);
    failure_ = make_error(ErrorCode::Unavailable, "{}", std::strerror(errno));
  }
  thread_ = std::thread([this] {
    name_thread("record/disk");
    run();
  });
}

bool RecordFile::take(mcap::Bytes bytes, bool is_vital) {
  {
    const std::lock_guard lock(mutex_);
    const uint64_t limit = kMaxWaitingBytes + (is_vital ? kVitalBytes : 0);
    // One that is larger than that finds room where nothing waits.
    const bool has_room = waiting_.empty() || waiting_bytes_ + bytes.size() <= limit;
    if (failure_ || !has_room) return false;
    waiting_bytes_ += bytes.size();
    waiting_.push_back(std::move(bytes));
  }
  changed_.notify_one();
  return true;
}

void RecordFile::finish() {
  {
    const std::lock_guard lock(mutex_);
    is_finishing_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RecordFile::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return is_finishing_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const mcap::Bytes bytes = std::move(waiting_.front());
    lock.unlock();
    const Status status = write(bytes);
    lock.lock();
    // Counted until here: what is being written waits too.
    waiting_.pop_front();
    waiting_bytes_ -= bytes.size();
    if (status) {
      written_bytes_ += bytes.size();
      continue;
    }
    failure_ = status.error();
    waiting_.clear();
    waiting_bytes_ = 0;
    return;
  }
}

/// All or nothing: after an error the file ends where it was before.
Status RecordFile::write(const mcap::Bytes& bytes) {
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = ::write(file_, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written > 0) {
      done += static_cast<size_t>(written);
      continue;
    }
    const Error error = make_error(ErrorCode::Unavailable, "{}", std::strerror(errno));
    uint64_t whole = 0;
    {
      const std::lock_guard lock(mutex_);
      whole = written_bytes_;
    }
    // Where that fails too, readers stop at the record that is not whole.
    [[maybe_unused]] const int result = ::ftruncate(file_, static_cast<off_t>(whole));
    return error;
  }
  return {};
}

uint64_t RecordFile::waiting_bytes() const {
  const std::lock_guard lock(mutex_);
  return waiting_bytes_;
}

uint64_t RecordFile::written_bytes() const {
  const std::lock_guard lock(mutex_);
  return written_bytes_;
}

std::optional<Error> RecordFile::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace strandcast
