#include "server/encode/picture_passes.h"

#include "common/render/render_device.h"
#include "server/encode/picture_painter.h"

namespace strandcast {

gl::PassReports picture_passes(const PictureTimers& timers, const gl::PassReports& painted,
                               PictureCodecs wanted) {
  gl::PassReports passes = {
      gl::make_report("encode/decode", gl::PassFate::Kept, "writes what a viewer would have", timers.decode)};
  passes.insert(passes.end(), painted.begin(), painted.end());
  for (const PictureCodec codec : kPictureCodecs) {
    // Of what nobody wants it is not tried whether its encoder starts.
    if ((decodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const bool is_wanted = (wanted & codec_bit(codec)) != 0;
    passes.push_back(gl::make_report(
        fmt::format("encode/{}", to_string(codec)), is_wanted ? gl::PassFate::Kept : gl::PassFate::Unread,
        is_wanted ? "writes pictures for viewers" : "no viewer takes pictures coded so",
        timers.encode[static_cast<size_t>(codec)]));
  }
  return passes;
}

Result<gl::PassReports> plan_picture_passes(const SceneAsset& asset, const LookDesc& look, RendererKind kind,
                                            PictureCodecs wanted) {
  ASSIGN_OR_RETURN(gl::PassReports painted, plan_renderer(asset, look, kind));
  painted.push_back(read_back_report(StageTimer()));
  return picture_passes({}, painted, wanted);
}

}  // namespace strandcast
