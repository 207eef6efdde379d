// Which CRS a grid must be in, and how CRSs are read, compared and named.
#include <cmath>

#include "db/raster_impl.h"

namespace patchwork::raster_impl {

namespace {

// A projected unit this close to a metre is a metre that was printed with fewer digits.
constexpr double kMetreTolerance = 1e-9;
// Where UTM ends and the polar zones (UPS) begin, degrees.
constexpr double kUtmNorth = 84, kUtmSouth = -80;

bool plane_of_metres(const OGRSpatialReference& crs) {
  return (crs.IsProjected() || crs.IsLocal()) && std::abs(crs.GetLinearUnits() - 1) <= kMetreTolerance;
}

OGRSpatialReference from_epsg(int code) {
  OGRSpatialReference crs;
  if (crs.importFromEPSG(code) != OGRERR_NONE)
    throw Error("EPSG:" + std::to_string(code), "is not in PROJ's database",
                "check the installation of PROJ");
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return crs;
}

Point footprint_centre(const RawGrid& grid) {
  const auto& gt = grid.geotransform;
  const double u = grid.width / 2.0, v = grid.height / 2.0;
  return {gt[0] + gt[1] * u + gt[2] * v, gt[3] + gt[4] * u + gt[5] * v};
}

// Longitude and latitude (WGS 84, degrees) of the grid's centre.
Point centre_lon_lat(const RawGrid& grid) {
  const GdalMessages messages;
  const OGRSpatialReference wgs84 = from_epsg(4326);
  const std::unique_ptr<OGRCoordinateTransformation> transform(
      OGRCreateCoordinateTransformation(&*grid.crs, &wgs84));
  Point p = footprint_centre(grid);
  if (!transform || !transform->Transform(1, &p.x, &p.y) || !std::isfinite(p.x) || !(std::abs(p.y) <= 90))
    throw Error(grid.path,
                messages.explain("its centre has no longitude and latitude in " + crs_label(*grid.crs)),
                "check its georeference, e.g. with gdalinfo");
  return p;
}

int zone_epsg(Point lon_lat) {
  if (lon_lat.y > kUtmNorth) return 5041;
  if (lon_lat.y < kUtmSouth) return 5042;
  const double turn = std::fmod(std::fmod(lon_lat.x + 180, 360) + 360, 360);
  const int zone = 1 + static_cast<int>(turn / 6);
  return (lon_lat.y >= 0 ? 32600 : 32700) + zone;
}

OGRSpatialReference zone_of(RawGrid& grid) {
  OGRSpatialReference zone = from_epsg(zone_epsg(centre_lon_lat(grid)));
  grid.warnings.push_back("its CRS " + crs_label(*grid.crs) +
                          " is not a plane of metres: the database takes that of its centre, " +
                          crs_label(zone) + " (" + zone.GetName() + ")");
  return zone;
}

OGRSpatialReference database_plane(const std::string& text) {
  OGRSpatialReference crs = parse_crs(text, "database CRS");
  make_horizontal(crs);
  if (!plane_of_metres(crs))
    throw Error("database CRS", crs_label(crs) + " is not a projected CRS in metres",
                "choose one such as EPSG:32610");
  return crs;
}

}  // namespace

OGRSpatialReference parse_crs(const std::string& text, const std::string& where) {
  const GdalMessages messages;
  const char* const options[] = {"ALLOW_NETWORK_ACCESS=NO", "ALLOW_FILE_ACCESS=NO", nullptr};
  OGRSpatialReference crs;
  if (text.empty() || crs.SetFromUserInput(text.c_str(), options) != OGRERR_NONE)
    throw Error(where, messages.explain("\"" + text.substr(0, 80) + "\" is not a CRS that GDAL understands"),
                "use a form such as EPSG:32610");
  return crs;
}

bool make_horizontal(OGRSpatialReference& crs) {
  const bool vertical = crs.IsCompound() || crs.GetAxesCount() == 3;
  if (crs.IsCompound()) crs.StripVertical();
  if (crs.GetAxesCount() == 3) crs.DemoteTo2D(nullptr);
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return vertical;
}

bool same_crs(const OGRSpatialReference& a, const OGRSpatialReference& b) {
  const char* const options[] = {"CRITERION=EQUIVALENT", "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", nullptr};
  return a.IsSame(&b, options);
}

std::string to_wkt2(const OGRSpatialReference& crs) {
  const char* const options[] = {"FORMAT=WKT2_2018", "MULTILINE=NO", nullptr};
  char* text = nullptr;
  const bool done = crs.exportToWkt(&text, options) == OGRERR_NONE && text;
  const std::string wkt = done ? text : "";
  CPLFree(text);
  if (wkt.empty()) throw Error(crs_label(crs), "cannot be written as WKT2", "give --crs");
  return wkt;
}

std::string crs_label(const OGRSpatialReference& crs) {
  const char* const authority = crs.GetAuthorityName(nullptr);
  const char* const code = crs.GetAuthorityCode(nullptr);
  if (authority && code) return std::string(authority) + ":" + code;
  const char* const name = crs.GetName();
  return std::string("\"").append(name ? name : "unnamed").append("\"");
}

std::optional<OGRSpatialReference> domain_crs(RawGrid& grid, const std::string& database_crs) {
  if (!grid.crs) {
    grid.warnings.push_back(database_crs.empty() ? "names no CRS: its coordinates are taken as metres"
                                                 : "names no CRS: taken to be in the database's");
    if (database_crs.empty()) return std::nullopt;
  }
  if (!database_crs.empty()) return database_plane(database_crs);
  if (plane_of_metres(*grid.crs)) return grid.crs;
  return zone_of(grid);
}

}  // namespace patchwork::raster_impl

namespace patchwork {

bool same_crs(const std::string& a, const std::string& b) {
  const raster_impl::GdalMessages quiet;
  OGRSpatialReference p, q;
  if (p.SetFromUserInput(a.c_str()) != OGRERR_NONE || q.SetFromUserInput(b.c_str()) != OGRERR_NONE)
    return a == b;
  raster_impl::make_horizontal(p), raster_impl::make_horizontal(q);
  return raster_impl::same_crs(p, q);
}

}  // namespace patchwork
