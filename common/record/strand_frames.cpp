#include "common/record/strand_frames.h"

#include <utility>

namespace strandcast {

Result<std::unique_ptr<StrandDecoder>> make_recorded_decoder(const RecordingReader& reader) {
  ASSIGN_OR_RETURN(const SceneAsset asset, reader.asset());
  ASSIGN_OR_RETURN(auto decoder,
                   make_strand_decoder(reader.start().codec, {asset.strand_count, asset.vertex_count}));
  decoder->set_rest_shape(asset.rest_position_m);
  return decoder;
}

Result<StrandFrames> StrandFrames::begin(RecordingReader& reader) {
  ASSIGN_OR_RETURN(auto decoder, make_recorded_decoder(reader));
  return StrandFrames(reader, std::move(decoder));
}

Result<std::shared_ptr<const Snapshot>> StrandFrames::next() {
  while (true) {
    ASSIGN_OR_RETURN(const auto item, reader_->next());
    if (!item) return std::shared_ptr<const Snapshot>();
    if (const auto* frame = std::get_if<RecordedFrame>(&item->what))
      return decoder_->decode(frame->frame->message);
  }
}

}  // namespace strandcast
