#version 450
// A pixel without terrain.
#extension GL_GOOGLE_include_directive : require
#include "effects.glsl"

layout(location = 0) out vec4 color;

void main() { color = picture_color(shade_sky(direction_through(gl_FragCoord.x, gl_FragCoord.y))); }
