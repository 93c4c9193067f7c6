#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/base/version.h"
#include "common/record/chunk_list.h"
#include "common/record/mcap_writer.h"
#include "common/record/recording_check.h"
#include "common/record/recording_layout.h"

namespace strandcast {
namespace {

/// Writes at once.
class SyncSink : public mcap::ByteSink {
 public:
  explicit SyncSink(int file) : file_(file) {}
  bool take(mcap::Bytes bytes, bool) override {
    for (size_t done = 0; done < bytes.size();) {
      const ssize_t written = ::write(file_, bytes.data() + done, bytes.size() - done);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        failure_ = errno;
        return false;
      }
      done += static_cast<size_t>(written);
    }
    return true;
  }
  Status status() const {
    if (failure_ == 0) return {};
    return make_error(ErrorCode::Unavailable, "cannot be written: {}", std::strerror(failure_));
  }

 private:
  const int file_;
  int failure_ = 0;
};

/// Channels of the file must be those of this version: chunks are copied as they are.
Status check_channels(const ChunkList& list) {
  for (const mcap::Channel& channel : recording_channels()) {
    const auto found = list.topics.find(channel.id);
    if (found == list.topics.end() || found->second != channel.topic)
      return make_error(ErrorCode::Unsupported, "channel {} is not {}: take the program that recorded it",
                        channel.id, channel.topic);
  }
  return {};
}

Status copy_chunks(ByteSource& source, const ChunkList& list, SyncSink& sink, Recovery& recovery) {
  mcap::McapWriter writer(sink, {kRecordingProfile, fmt::format("strandcast {} recover", version())},
                          recording_schemas(), recording_channels());
  for (const ChunkPlace& place : list.chunks) {
    auto loaded = load_chunk(source, place);
    auto body = loaded ? chunk_body_of(std::move(loaded->records)) : Result<mcap::ChunkBody>(loaded.error());
    if (!body) {
      ++recovery.left_out_chunks;
      continue;
    }
    const mcap::Bytes& stored = loaded->compression.empty() ? body->records : loaded->stored;
    if (!writer.write(*body, stored, loaded->compression, true)) return sink.status();
    ++recovery.kept_chunks;
  }
  writer.finish();
  return sink.status();
}

}  // namespace

Result<Recovery> recover_recording(const std::filesystem::path& from, const std::filesystem::path& to) {
  ASSIGN_OR_RETURN(const auto source, open_byte_source(from));
  const auto list = walk_chunks(*source);
  if (!list) return at(from.string(), list.error());
  if (const Status status = check_channels(*list); !status) return at(from.string(), status.error());
  constexpr mode_t kMode = 0640;
  const int file = ::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
  if (file < 0)
    return at(to.string(), make_error(ErrorCode::BadInput, "cannot be made: {}", std::strerror(errno)));
  Recovery recovery;
  recovery.cut_bytes = list->cut_bytes;
  SyncSink sink(file);
  const Status written = copy_chunks(*source, *list, sink, recovery);
  const bool is_closed = ::close(file) == 0;
  if (!written || !is_closed) {
    ::unlink(to.c_str());
    return at(to.string(),
              written ? make_error(ErrorCode::Unavailable, "cannot be written") : written.error());
  }
  ASSIGN_OR_RETURN(recovery.check, check_recording(to));
  return recovery;
}

}  // namespace strandcast
