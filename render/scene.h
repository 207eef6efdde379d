// A scene: from where a picture is taken, how exact it is, and the effects that it calls for.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "blend/blend.h"
#include "render/camera.h"
#include "render/effects/contours.h"
#include "render/effects/curvature.h"
#include "render/effects/haze.h"
#include "render/effects/overlays.h"
#include "render/effects/shadow.h"
#include "render/effects/sky.h"
#include "render/effects/solar_disc.h"
#include "render/effects/sun.h"
#include "render/effects/tints.h"
#include "render/effects/water.h"
#include "render/picture.h"

namespace patchwork {

/// From where a single picture is taken.
struct Viewpoint {
  Point3 eye, look;         ///< metres; they differ
  double fov_degrees = 60;  ///< vertical
};

/// A flight through points; camera_path.h makes the frames.
struct Flight {
  static constexpr int kMostFrames = 1000000;
  std::vector<Point3> points;   ///< two or more; neighbours differ in the plane
  std::vector<Point3> targets;  ///< looked at on the way: none, one, or one for each point
  double look_ahead = 300;      ///< metres of way ahead that the eye looks at, without targets
  double pitch = -10;           ///< degrees above the way ahead, without targets
  double speed = 100;           ///< metres a second over ground
  double frames_per_second = 30;
  std::optional<int> frames;  ///< so many, evenly spaced over the way, whatever the speed
  double fov_degrees = 60;    ///< vertical
};

/// An effect that is not there costs nothing.
struct SceneEffects {
  std::optional<effects::Sun> sun;
  std::optional<effects::Shadow> shadow;  ///< only with the sun
  std::optional<effects::Sky> sky;
  std::optional<effects::Water> water;
  std::optional<effects::Haze> haze;
  std::optional<effects::Curvature> curvature;
  std::optional<effects::SolarDisc> solar_disc;  ///< only with the sun
  std::optional<effects::Tints> tints;
  std::optional<effects::Contours> contours;
  std::optional<effects::ErrorOverlay> error;  ///< at most one of these three
  std::optional<effects::SourceOverlay> source;
  std::optional<effects::CostOverlay> cost;
  std::optional<effects::Wireframe> wireframe;
};

struct Scene {
  std::optional<Viewpoint> camera;  ///< at most one of camera and path; neither: all of the terrain
  std::optional<Flight> path;
  int width = 1280, height = 720;  ///< pixels
  double pixel_error = 1;          ///< pixels
  int smoothness = 1;              ///< k = 0, 1, 2
  Composition blend = Composition::priority;
  std::optional<double> far;           ///< metres along the line of sight; without: all of the terrain
  Color background{0xbf, 0xd4, 0xe8};  ///< of the sky
  bool legend = true;                  ///< drawn where an effect has a scale
  SceneEffects effects;

  /// The camera of `camera` at the scene's size. REQUIRES: camera.
  Camera view() const { return {camera->eye, camera->look, camera->fov_degrees, width, height}; }
};

/// What is shown where no scene is named: all of the terrain, in sunlight, coloured by height.
Scene default_scene();
std::string default_scene_text();  ///< the same as JSON

/// Throws Error(where, "PLACE: what is wrong", advice), PLACE as in "effects.sun.elevation": no JSON, a
/// member that is unknown, missing, of the wrong type or out of its range, effects that need or exclude each
/// other.
Scene parse_scene(const std::string& json, const std::string& where);
/// What a file holds. Throws Error: it cannot be read.
std::string scene_text(const std::string& path);
/// Both in one.
Scene read_scene(const std::string& path);

/// The JSON schema (draft 2020-12) of what parse_scene takes; render/scene.schema.json is this text.
std::string scene_schema();

}  // namespace patchwork
