#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include "common/base/version.h"
#include "common/record/chunk_items.h"
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

/// A chunk that can be written again as it stands.
struct SoundChunk {
  LoadedChunk loaded;
  mcap::ChunkBody body;
};

Result<SoundChunk> load_sound(ByteSource& source, const ChunkPlace& place) {
  SoundChunk chunk;
  ASSIGN_OR_RETURN(chunk.loaded, load_chunk(source, place));
  ASSIGN_OR_RETURN(chunk.body, chunk_body_of(std::move(chunk.loaded.records)));
  return chunk;
}

/// Only of this channel.
bool is_of(const mcap::ChunkBody& body, uint16_t channel) {
  return body.index.size() == 1 && body.index.contains(channel);
}

/// Copies chunks, what the recording is of first and last, and leaves frames out that lost what they build
/// on.
class ChunkCopy {
 public:
  ChunkCopy(ByteSource& source, const ChunkList& list, SyncSink& sink, Recovery& recovery)
      : source_(source),
        list_(list),
        recovery_(recovery),
        writer_(sink, {kRecordingProfile, fmt::format("strandcast {} recover", version())},
                recording_schemas(), recording_channels()) {
    for (const auto& [id, topic] : list.topics) uses_.add(id, topic);
  }

  void run() {
    const auto start = first_sound(kStartChannel);
    const auto asset = first_sound(kAssetChannel);
    const auto put_what_it_is_of = [&] {
      if (start) put(*start);
      if (asset) put(*asset);
    };
    put_what_it_is_of();
    for (const ChunkPlace& place : list_.chunks) copy(place, asset.has_value());
    put_what_it_is_of();
    writer_.finish();
  }

 private:
  static constexpr uint16_t kStartChannel = 1;

  void put(const SoundChunk& chunk) {
    const mcap::Bytes& stored = chunk.loaded.compression.empty() ? chunk.body.records : chunk.loaded.stored;
    writer_.write(chunk.body, stored, chunk.loaded.compression, true);
  }

  std::optional<SoundChunk> first_sound(uint16_t channel) {
    for (const ChunkPlace& place : list_.chunks) {
      if (place.channel != channel && place.channel != kUnknownChannel) continue;
      auto chunk = load_sound(source_, place);
      if (chunk && is_of(chunk->body, channel)) return std::move(chunk).value();
    }
    return std::nullopt;
  }

  void copy(const ChunkPlace& place, bool has_asset) {
    const auto chunk = load_sound(source_, place);
    if (!chunk) {
      ++recovery_.left_out_chunks;
      return;
    }
    const bool has_frames = is_of(chunk->body, kKeyframeChannel) || is_of(chunk->body, kDeltaChannel);
    if (has_frames && !(has_asset && follows(chunk->body))) {
      recovery_.left_out_frames += items_of(chunk->body.records, uses_).items.size();
      return;
    }
    ++recovery_.kept_chunks;
    // These two were written before all else.
    if (!is_of(chunk->body, kStartChannel) && !is_of(chunk->body, kAssetChannel)) put(*chunk);
  }

  /// Whether these frames can be decoded after those that were copied.
  bool follows(const mcap::ChunkBody& body) {
    const ChunkItems found = items_of(body.records, uses_);
    bool is_first = true;
    for (const ChunkItem& item : found.items) {
      auto media = std::span<const std::byte>(item.bytes);
      if (item.channel == kKeyframeChannel) {
        const auto decoded = decode_media(item.bytes);
        if (!decoded) return false;
        media = *decoded;
      }
      const auto header = unpack_frame_header(media);
      if (!header) return false;
      const bool is_keyframe = header->opcode == Opcode::StrandKeyframe;
      if (is_first && !is_keyframe && header->base_sequence != newest_sequence_) return false;
      is_first = false;
      newest_sequence_ = header->sequence;
    }
    return !is_first;
  }

  ByteSource& source_;
  const ChunkList& list_;
  Recovery& recovery_;
  mcap::McapWriter writer_;
  ChannelUses uses_;
  uint32_t newest_sequence_ = 0;  // of the frames that were copied
};

}  // namespace

Result<Recovery> recover_recording(const std::filesystem::path& from, const std::filesystem::path& to) {
  ASSIGN_OR_RETURN(const auto source, open_byte_source(from));
  const auto list = list_chunks(*source);
  if (!list) return at(from.string(), list.error());
  if (const Status status = check_channels(*list); !status) return at(from.string(), status.error());
  if (std::error_code error; std::filesystem::exists(std::filesystem::symlink_status(to, error)))
    return at(to.string(), make_error(ErrorCode::BadInput, "the file is there already: name another one"));
  // Written beside it: what bears the name is whole.
  std::filesystem::path part = to;
  part += ".part";
  constexpr mode_t kMode = 0640;
  const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, kMode);
  if (file < 0)
    return at(to.string(), make_error(ErrorCode::BadInput, "cannot be made: {}", std::strerror(errno)));
  Recovery recovery;
  recovery.cut_bytes = list->cut_bytes;
  SyncSink sink(file);
  ChunkCopy(*source, *list, sink, recovery).run();
  const Status written = sink.status();
  const bool is_closed = ::close(file) == 0;
  if (!written || !is_closed || ::rename(part.c_str(), to.c_str()) != 0) {
    const Error failure =
        written ? make_error(ErrorCode::Unavailable, "cannot be written: {}", std::strerror(errno))
                : written.error();
    ::unlink(part.c_str());
    return at(to.string(), failure);
  }
  ASSIGN_OR_RETURN(recovery.check, check_recording(to));
  return recovery;
}

}  // namespace strandcast
