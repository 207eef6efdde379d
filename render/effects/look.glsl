// The numbers of a frame's effects. Shaders read them as a uniform block (vec4 alone: std140 packs nothing), the
// CPU's reference in double; effects/look.cpp fills them in. Colours are linear light.
struct Look {
  vec4 sun_direction;  // unit, towards the sun; w: tan of its elevation
  vec4 sun_light;      // colour * strength; w: half the angle over which a shadow fades, radians
  vec4 ambient;        // colour * strength; w: strength of shadows
  vec4 ground;         // the colour where no tints are; w: strength of the sky's light
  vec4 background;     // of the sky; w: metres that ground sinks a square metre of distance
  vec4 air;            // colour; w: 1 / metres of optical depth at the eye's height
  vec4 air_scale;      // x: 1 / scale height, y: height of the eye, metres; z: glow of the sun; w: 1 / glow's radius
  vec4 water;          // colour; w: level, metres
  vec4 water_surface;  // x: height of waves, metres, y: 1 / clarity; zw: the eye's place within the waves' period
  vec4 tints;          // x: lowest, y: 1 / (highest - lowest), metres; z: cosine of the solar disc's radius
  vec4 contours;       // colour; w: opacity
  vec4 contour_lines;  // x: interval, metres; y: every so many are bold (0: none); z: width, pixels
  vec4 overlay;        // x: lowest, y: highest, z: 1 for a logarithmic scale, w: opacity
  vec4 wireframe;      // colour; w: opacity
  vec4 light_map;      // xy: the eye's place in it, samples; z: samples a metre
  vec4 view_right;     // the camera's axes; w: radians a pixel in the picture's middle
  vec4 view_up;        // w: half of the picture's width, pixels
  vec4 view_forward;   // w: half of its height
};
