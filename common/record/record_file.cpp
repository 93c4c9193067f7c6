#include "common/record/record_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/thread_name.h"
#include "common/record/chunk_list.h"

namespace strandcast {

namespace {

constexpr mode_t kMode = 0640;  // who connected is in it

/// One program writes into a recording. Where files cannot be locked, nobody is kept out.
bool is_locked_by_another(int file) {
  return ::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

Error locked() {
  return make_error(ErrorCode::BadInput, "another program records into it");
}

/// What stands where the recording is to be: it stays open, and locked, until the new one bears its name.
Result<int> hold_present(const std::filesystem::path& path, IfPresent if_present) {
  // A device or a pipe is never opened: that could wait for another program.
  struct stat present {};
  if (::stat(path.c_str(), &present) != 0 || !S_ISREG(present.st_mode))
    return make_error(ErrorCode::BadInput, "not a regular file");
  if (if_present == IfPresent::Refuse && present.st_size > 0)
    return make_error(ErrorCode::BadInput,
                      "the file is there already: name another one, or say --record-replace");
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return make_error(ErrorCode::NotFound, "cannot be written: {}", std::strerror(errno));
  Status status;
  if (is_locked_by_another(file)) status = locked();
  if (status && present.st_size > 0) {
    const auto source = open_byte_source(path);
    const Status is_recording = source ? check_is_recording(**source) : Status(source.error());
    if (!is_recording)
      status =
          make_error(ErrorCode::BadInput, "only a recording is replaced: {}", is_recording.error().message);
  }
  if (status) return file;
  ::close(file);
  return status.error();
}

}  // namespace

Result<std::unique_ptr<RecordFile>> RecordFile::make(const std::filesystem::path& path,
                                                     IfPresent if_present) {
  int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
  if (file >= 0) {
    ::flock(file, LOCK_EX | LOCK_NB);
    return std::unique_ptr<RecordFile>(new RecordFile({file, kNoFile}, path, path));
  }
  if (errno != EEXIST)
    return at(path.string(), make_error(ErrorCode::NotFound, "cannot be written: {}", std::strerror(errno)));
  const auto present = hold_present(path, if_present);
  if (!present) return at(path.string(), present.error());
  std::filesystem::path part = path;
  part += ".part";
  file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode);
  if (file >= 0 && !is_locked_by_another(file))
    return std::unique_ptr<RecordFile>(new RecordFile({file, *present}, path, part));
  const Error error =
      file < 0 ? make_error(ErrorCode::NotFound, "cannot be written: {}", std::strerror(errno)) : locked();
  if (file >= 0) ::close(file);
  ::close(*present);
  return at(path.string(), error);
}

RecordFile::RecordFile(Files files, std::filesystem::path path, std::filesystem::path first_path)
    : file_(files.written),
      present_(files.present),
      path_(std::move(path)),
      first_path_(std::move(first_path)) {}

RecordFile::~RecordFile() {
  finish();
  if (!is_kept_) ::unlink(first_path_.c_str());
  ::close(file_);
  if (present_ != kNoFile) ::close(present_);
}

void RecordFile::keep() {
  is_kept_ = true;
  const bool is_named = first_path_ == path_ || ::rename(first_path_.c_str(), path_.c_str()) == 0;
  if (!is_named || ::ftruncate(file_, 0) != 0) {
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
