#include "client/app/drawn_states.h"

#include <utility>

#include "common/render/drawn_strands.h"

namespace strandcast {
namespace {

class DrawnShapes : public ExportDrawing {
 public:
  DrawnShapes(DrawnHair hair, const std::vector<glm::vec3>& rest_position_m) : hair_(std::move(hair)) {
    DrawnStrands rest = hair_.strands(rest_position_m);
    shape_ = {std::move(rest.first_point), std::move(rest.width_m)};
  }
  const ExportShape& shape() const override { return shape_; }
  std::vector<glm::vec3> points(const std::vector<glm::vec3>& position_m) override {
    return hair_.strands(position_m).position_m;
  }

 private:
  DrawnHair hair_;
  ExportShape shape_;
};

class StatesOfScene : public ExportSource {
 public:
  StatesOfScene(std::unique_ptr<ExportSource> source, ExportScene scene)
      : source_(std::move(source)), scene_(std::move(scene)) {}
  const ExportScene& scene() const override { return scene_; }
  std::optional<CountedState> counted() const override { return source_->counted(); }
  const TimecodeTrack& timecodes() const override { return source_->timecodes(); }
  Result<std::optional<int64_t>> skip_to(double from_s) override { return source_->skip_to(from_s); }
  Result<std::shared_ptr<const Snapshot>> next() override { return source_->next(); }
  std::vector<std::string> remarks() const override { return source_->remarks(); }

 private:
  std::unique_ptr<ExportSource> source_;
  ExportScene scene_;
};

}  // namespace

Result<std::unique_ptr<ExportSource>> as_drawn(std::unique_ptr<ExportSource> source, const LookDesc& look) {
  ExportScene scene = source->scene();
  ASSIGN_OR_RETURN(DrawnHair hair, DrawnHair::make(*scene.asset, look));
  scene.drawing = std::make_shared<DrawnShapes>(std::move(hair), scene.asset->rest_position_m);
  return std::unique_ptr<ExportSource>(std::make_unique<StatesOfScene>(std::move(source), std::move(scene)));
}

std::unique_ptr<ExportSource> with_origin(std::unique_ptr<ExportSource> source,
                                          std::shared_ptr<const ExportOrigin> origin) {
  ExportScene scene = source->scene();
  scene.origin = std::move(origin);
  return std::make_unique<StatesOfScene>(std::move(source), std::move(scene));
}

}  // namespace strandcast
