// patchwork import: what comes in, under which name, in which CRS; and what --dry-run, a signal and a failure
// leave.
#include <signal.h>
#include <sqlite3.h>

#include "tests/cli/command.h"

namespace patchwork {

class Import : public CliTest {
 protected:
  double height(const std::string& db, double x, double y) const {
    const Outcome o =
        run({"sample", db, "--quiet"}, {.input = std::to_string(x) + " " + std::to_string(y) + "\n"});
    std::istringstream in(o.out);
    std::string text;
    in >> text >> text >> text;
    return text.empty() ? NAN : std::stod(text);
  }
  Words names(const std::string& db) const {
    Words all;
    const Json document = json({"list", db, "--json"});
    for (const Json& g : document["grids"]) all.push_back(g["name"]);
    return all;
  }
  bool in_folder(const std::string& part) const {
    for (const auto& entry : std::filesystem::directory_iterator(in_directory("")))
      if (entry.path().filename().string().find(part) != std::string::npos) return true;
    return false;
  }
};

TEST_F(Import, TakesSeveralFilesEachUnderItsOwnName) {
  const std::string db = in_directory("d.pwk");
  const std::string a = make(hill_file(), "west.tif"), b = make(hill_file(60, 50, 600), "east.tif");
  const Json report = json({"import", db, a, b, "--accuracy", "0.1", "--json"});
  ASSERT_EQ(report["grids"].size(), 2u);
  EXPECT_EQ(report["grids"][1]["name"], "east");
  EXPECT_EQ(names(db), (Words{"west", "east"}));
}

TEST_F(Import, NamesAreGivenOnceEach) {
  const std::string db = in_directory("d.pwk"), a = make(hill_file(), "a.tif"),
                    b = make(hill_file(60, 50, 600), "b.tif");
  EXPECT_EQ(run({"import", db, a, "--name", "hill and dale", "--quiet"}).code, 0);
  EXPECT_EQ(names(db), Words{"hill and dale"});
  const std::string before = content_hash(db);
  const Outcome again = run({"import", db, b, "--name", "hill and dale"});
  EXPECT_SAYS(complaint(again), "a grid named hill and dale already");
  EXPECT_SAYS(complaint(again), "--name");
  EXPECT_EQ(content_hash(db), before);
  EXPECT_EQ(run({"import", db, b, "--quiet"}).code, 0);
  EXPECT_EQ(names(db), (Words{"hill and dale", "b"}));
}

TEST_F(Import, TheSameGridTwiceIsThereOnce) {
  const std::string db = in_directory("d.pwk"), a = make(hill_file(), "a.tif");
  json({"import", db, a, "--json"});
  const std::string before = content_hash(db);
  const Json again = json({"import", db, a, "--name", "twin", "--json"});
  EXPECT_EQ(again["grids"][0]["duplicate_of"], "a");
  EXPECT_EQ(names(db), Words{"a"});
  EXPECT_EQ(content_hash(db), before);
  // It cannot take the place of a third.
  const std::string b = make(hill_file(70, 60), "b.tif");
  json({"import", db, b, "--json"});
  const std::string both = content_hash(db);
  const Outcome o = run({"import", db, a, "--name", "c", "--replace", "b"});
  EXPECT_SAYS(complaint(o), "the same grid is there as a already");
  EXPECT_EQ(content_hash(db), both);
}

TEST_F(Import, SignedBytesKeepTheirHoles) {
  RasterFile file = hill_file();
  file.type = GDT_Int16, file.nodata = -128;
  file.at = [](int i, int) { return i < 10 ? -128. : 5.; };
  const std::string path = make(file, "wide.tif"), bytes = in_directory("bytes.tif"),
                    db = in_directory("bytes.pwk"), back = in_directory("back.tif");
  {
    const GDALDatasetUniquePtr from(GDALDataset::Open(path.c_str()));
    CPLStringList options;
    options.SetNameValue("PIXELTYPE", "SIGNEDBYTE");
    GDALDriver* tiff = GetGDALDriverManager()->GetDriverByName("GTiff");
    const GDALDatasetUniquePtr to(tiff->Create(bytes.c_str(), 60, 50, 1, GDT_Byte, options.List()));
    ASSERT_TRUE(from && to);
    std::vector<std::int16_t> v(60 * 50);
    std::vector<std::int8_t> narrow(v.size());
    ASSERT_EQ(
        from->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, 60, 50, v.data(), 60, 50, GDT_Int16, 0, 0, nullptr),
        CE_None);
    std::copy(v.begin(), v.end(), narrow.begin());
    double place[6];
    from->GetGeoTransform(place), to->SetGeoTransform(place);
    to->SetProjection(from->GetProjectionRef());
    to->GetRasterBand(1)->SetNoDataValue(-128);
    ASSERT_EQ(to->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 60, 50, narrow.data(), 60, 50, GDT_Byte, 0, 0,
                                             nullptr),
              CE_None);
  }
  ASSERT_EQ(run({"import", db, bytes, "--accuracy", "1", "--quiet"}).code, 0);
  ASSERT_EQ(run({"export", db, "bytes", back, "--quiet"}).code, 0);
  const GDALDatasetUniquePtr d(GDALDataset::Open(back.c_str()));
  ASSERT_TRUE(d);
  std::vector<double> v(60 * 50);
  ASSERT_EQ(
      d->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, 60, 50, v.data(), 60, 50, GDT_Float64, 0, 0, nullptr),
      CE_None);
  EXPECT_EQ(std::count(v.begin(), v.end(), d->GetRasterBand(1)->GetNoDataValue()), 10 * 50);
  EXPECT_EQ(std::count(v.begin(), v.end(), 5), 50 * 50);
}

TEST_F(Import, JoinedTilesEqualTheWhole) {
  const std::string whole = in_directory("whole.pwk"), joined = in_directory("joined.pwk"),
                    apart = in_directory("apart.pwk");
  const std::string all = make(hill_file(120, 50), "all.tif");
  const std::string west = make(hill_file(60, 50), "west.tif"),
                    east = make(hill_file(60, 50, 600), "east.tif");
  json({"import", whole, all, "--name", "g", "--accuracy", "0.1", "--json"});
  const Json report =
      json({"import", joined, west, east, "--join", "--name", "g", "--accuracy", "0.1", "--json"});
  json({"import", apart, west, east, "--accuracy", "0.1", "--json"});
  EXPECT_EQ(report["grids"].size(), 1u);
  EXPECT_EQ(content_hash(joined), content_hash(whole));
  EXPECT_NE(content_hash(apart), content_hash(whole)) << "two grids that touch are not one";
}

TEST_F(Import, UnitsOffsetsAndNodataReachTheHeights) {
  const std::string db = in_directory("d.pwk");
  RasterFile file = hill_file();
  file.at = [](int i, int j) { return i < 20 && j < 20 ? -1 : i > 40 && j > 30 ? -2 : 1000; };
  const std::string path = make(file);
  EXPECT_EQ(run({"import", db, path, "--unit", "ft", "--vertical-offset", "-4.8", "--nodata", "-1",
                 "--nodata", "-2", "--accuracy", "0.1", "--quiet"})
                .code,
            0);
  EXPECT_NEAR(height(db, 500305, 4999695), 300, 1e-9);
  EXPECT_TRUE(std::isnan(height(db, 500105, 4999895)));
  EXPECT_TRUE(std::isnan(height(db, 500505, 4999605)));
}

// What is stored to within a tolerance may come to lie where the file had no data.
TEST_F(Import, HeightsThatCameToEqualNodataAreExportedAsHeights) {
  RasterFile file = hill_file();
  file.type = GDT_UInt16, file.nodata = 0;
  file.at = [](int i, int j) { return i < 10 ? 0. : 1 + (i + j) % 3; };
  const std::string path = make(file, "shore.tif"), back = in_directory("back.tif");
  for (const char* tolerance : {"2", "0"}) {
    const std::string db = in_directory(std::string("shore") + tolerance + ".pwk");
    ASSERT_EQ(run({"import", db, path, "--tolerance", tolerance, "--accuracy", "1", "--quiet"}).code, 0);
    ASSERT_EQ(run({"export", db, "shore", back, "--quiet"}).code, 0);
    const GDALDatasetUniquePtr d(GDALDataset::Open(back.c_str()));
    ASSERT_TRUE(d);
    GDALRasterBand& band = *d->GetRasterBand(1);
    std::vector<double> v(60 * 50);
    ASSERT_EQ(band.RasterIO(GF_Read, 0, 0, 60, 50, v.data(), 60, 50, GDT_Float64, 0, 0, nullptr), CE_None);
    const double nodata = band.GetNoDataValue();
    const auto holes =
        std::count_if(v.begin(), v.end(), [&](double h) { return std::isnan(h) || h == nodata; });
    EXPECT_EQ(holes, 10 * 50) << tolerance;
    EXPECT_EQ(std::isnan(nodata), tolerance[0] == '2') << "negative control: else it stays as it was";
  }
}

TEST_F(Import, DryRunChangesNothing) {
  const std::string file = make(hill_file(), "hills.tif"), fresh = in_directory("fresh.pwk");
  const Json first = json({"import", fresh, file, "--dry-run", "--json"});
  EXPECT_GT(first["grids"][0]["patches"].get<int>(), 0);
  EXPECT_FALSE(in_folder("fresh.pwk")) << "no new database is left behind";
  EXPECT_FALSE(first["grids"][0].contains("against_database"));

  const std::string db = hill_database(), over = make(hill_file(60, 50, 155, -95, 4), "over.tif");
  const std::string before = content_hash(db), bytes = text_of(db);
  const Json report = json({"import", db, over, "--dry-run", "--accuracy", "0.05", "--json"});
  EXPECT_GT(report["grids"][0]["patches"].get<int>(), 0);
  EXPECT_EQ(content_hash(db), before);
  EXPECT_EQ(text_of(db), bytes);
  EXPECT_EQ(names(db), Words{"hills"});
  const Json real = json({"import", db, over, "--accuracy", "0.05", "--json"});
  for (const char* key : {"patches", "dormant", "hidden", "lowered"})
    EXPECT_EQ(real["grids"][0][key], report["grids"][0][key]) << key;
  EXPECT_NE(content_hash(db), before) << "without --dry-run it changes";
}

TEST_F(Import, DryRunFindsAKnownOffsetAndTilt) {
  const std::string db = hill_database();
  RasterFile file = hill_file(60, 50, 105, -55, 5);
  const RasterFile level = file;
  const double cx = 500105 + 30 * 5, cy = 5000000 - 55 - 25 * 5;
  file.at = [&](int i, int j) {
    const double x = 500105 + (i + 0.5) * 5, y = 5000000 - 55 - (j + 0.5) * 5;
    const double outlier = (i + 7 * j) % 10 == 0 ? 80 : 0;  // a tenth of the samples: what "robust" is for
    return level.at(i, j) + 5 + 0.002 * (x - cx) - 0.001 * (y - cy) + outlier;
  };
  const auto against = [&](const RasterFile& f) {
    return json({"import", db, make(f, "new.tif"), "--dry-run", "--json"})["grids"][0]["against_database"];
  };
  const Json found = against(file), none = against(level);
  EXPECT_NEAR(found["offset"].get<double>(), 5, 0.05);
  EXPECT_NEAR(found["tilt_x"].get<double>(), 0.002, 1e-4);
  EXPECT_NEAR(found["tilt_y"].get<double>(), -0.001, 1e-4);
  EXPECT_GT(found["points"].get<int>(), 1000);
  EXPECT_NEAR(none["offset"].get<double>(), 0, 0.05);
  EXPECT_NEAR(none["tilt_x"].get<double>(), 0, 1e-4);
  EXPECT_SAYS(run({"import", db, in_directory("new.tif"), "--dry-run"}).out, "offset");
}

TEST_F(Import, AFileThatFailsLeavesTheOnesBeforeIt) {
  const std::string db = in_directory("d.pwk"), a = make(hill_file(), "a.tif"),
                    none = in_directory("none.tif");
  const Outcome o = run({"import", db, a, none, "--json"});
  EXPECT_SAYS(complaint(o), "none.tif: there is no such file");
  EXPECT_EQ(Json::parse(o.out)["grids"].size(), 1u);
  EXPECT_EQ(names(db), Words{"a"});
  EXPECT_EQ(run({"import", in_directory("e.pwk"), none, a}).code, 1);
  EXPECT_FALSE(in_folder("e.pwk"));
}

TEST_F(Import, CrsNamesThatOfANewDatabase) {
  const std::string db = in_directory("d.pwk");
  RasterFile bare = hill_file(), degrees = hill_file();
  bare.crs = "";
  degrees.crs = "EPSG:4326", degrees.geotransform = {-123, 1e-4, 0, 45, 0, -1e-4};
  const std::string plain = make(bare, "bare.tif"), geographic = make(degrees, "degrees.tif");
  const Json report = json({"import", db, plain, "--crs", "EPSG:32610", "--json"});
  EXPECT_SAYS(json({"info", db, "--json"})["crs"].get<std::string>(), "\"EPSG\",32610");
  EXPECT_SAYS(report["grids"][0]["warnings"].dump(), "names no CRS");

  EXPECT_SAYS(complaint(run({"import", db, make(hill_file(), "h.tif"), "--crs", "EPSG:32611"})),
              "its CRS is not EPSG:32611");
  EXPECT_EQ(run({"import", db, make(hill_file(), "h.tif"), "--crs", "EPSG:32610", "--quiet"}).code, 0);
  EXPECT_SAYS(complaint(run({"import", in_directory("n.pwk"), plain, "--crs", "EPSG:4326"})),
              "not a projected CRS");
  EXPECT_SAYS(complaint(run({"import", in_directory("n.pwk"), plain, "--crs", "Mars"})), "is not a CRS");
  EXPECT_FALSE(in_folder("n.pwk"));

  const std::string zone = in_directory("zone.pwk");
  const Outcome o = run({"import", zone, geographic});
  EXPECT_EQ(o.code, 0);
  EXPECT_SAYS(o.err, "EPSG:32610") << "the UTM zone of its centre, and it says so";
  EXPECT_SAYS(json({"info", zone, "--json"})["crs"].get<std::string>(), "\"EPSG\",32610");
}

TEST_F(Import, ADatabaseWithoutCrsRefusesAFileThatHasOne) {
  const std::string db = in_directory("d.pwk");
  RasterFile bare = hill_file();
  bare.crs = "";
  EXPECT_EQ(run({"import", db, make(bare, "bare.tif"), "--quiet"}).code, 0);
  const std::string before = content_hash(db), with_crs = make(hill_file(60, 50, 300), "with_crs.tif");
  EXPECT_SAYS(complaint(run({"import", db, with_crs})), "the database has none");
  EXPECT_SAYS(complaint(run({"import", db, with_crs})), "--crs");
  EXPECT_SAYS(complaint(run({"import", db, with_crs, "--crs", "EPSG:26710"})), "its CRS is not EPSG:26710");
  EXPECT_EQ(content_hash(db), before);
  bare.geotransform[0] += 300;
  EXPECT_EQ(run({"import", db, make(bare, "more.tif"), "--quiet"}).code, 0) << "another one without";
}

// What an import leaves that was killed before its first commit: a file without grids, with a CRS or not.
TEST_F(Import, AnEmptyDatabaseTakesTheCrsOfItsFirstGrid) {
  const std::string db = in_directory("d.pwk");
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(db.c_str(), &raw), SQLITE_OK);
  sqlite3_close(raw);
  EXPECT_EQ(run({"import", db, make(hill_file(), "h.tif"), "--quiet"}).code, 0);
  EXPECT_SAYS(json({"info", db, "--json"})["crs"].get<std::string>(), "26710");
}

TEST_F(Import, AnInterruptLeavesTheDatabaseAsItWas) {
  const std::string db = hill_database();
  RasterFile large = hill_file(3000, 3000, 0, 0, 0.2);
  large.at = [](int i, int j) { return 300 + (i * 31 + j * 17) % 97; };
  const std::string file = make(large, "large.tif"), before = content_hash(db);
  // On a busy machine the signal may come when all is done: then once more, and sooner.
  const auto interrupt = [&](const std::string& database, int signal, auto undo) {
    int ended_by = 0;
    for (useconds_t after = 100000; ended_by == 0 && after > 1000; after /= 2) {
      ended_by = run({"import", database, file, "--quiet"}, {.meanwhile =
                                                                 [&](pid_t child) {
                                                                   usleep(after);
                                                                   kill(child, signal);
                                                                 }})
                     .signal;
      if (ended_by == 0) undo();
    }
    EXPECT_EQ(ended_by, signal);
  };
  for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
    interrupt(db, signal, [&] { EXPECT_EQ(run({"remove", db, "large", "--quiet"}).code, 0); });
    EXPECT_EQ(content_hash(db), before) << signal;
  }
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const std::string fresh = in_directory("new.pwk");
    interrupt(fresh, signal, [&] { std::filesystem::remove(fresh); });
    EXPECT_FALSE(in_folder("new.pwk")) << signal;
  }
  EXPECT_EQ(run({"import", db, make(hill_file(60, 50, 300), "small.tif"), "--quiet"}).code, 0)
      << "and it still takes grids";
}

// Whoever is faster makes the file; the other one waits, and takes nothing away.
TEST_F(Import, TwoThatMakeOneDatabaseAtATimeLoseNothing) {
  const std::string a = make(hill_file(400, 300), "a.tif"), b = make(hill_file(300, 400, 300), "b.tif");
  const auto both = [&](const std::string& db, const char* first, const char* second) {
    Outcome other;
    const Outcome one = run({"import", db, a, "--name", first, "--quiet"}, {.meanwhile = [&](pid_t) {
                              other = run({"import", db, b, "--name", second, "--quiet"});
                            }});
    return one.code + other.code;
  };
  for (int n = 0; n < 5; ++n) {
    const std::string two = in_directory("two" + std::to_string(n)),
                      same = in_directory("same" + std::to_string(n));
    EXPECT_EQ(both(two, "one", "other"), 0);
    EXPECT_EQ(json({"list", two, "--json"})["grids"].size(), 2u);
    EXPECT_EQ(both(same, "one", "one"), 1) << "one of them comes too late";
    EXPECT_EQ(json({"list", same, "--json"})["grids"].size(), 1u);
    EXPECT_EQ(run({"check", same}).code, 0);
  }
}

}  // namespace patchwork
