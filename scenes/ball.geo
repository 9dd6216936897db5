// The half section of a cylinder, radius and height 20 mm, finer below the ball of scenes/ball.toml; x is the radius.
// The gmsh program writes the mesh, gmsh -2 scenes/ball.geo, or the Python module in archord's image:
// docker/run python3 -c 'import gmsh; gmsh.initialize(["", "scenes/ball.geo", "-2"], run=True)'
Mesh.MshFileVersion = 4.1;
near = 0.12;
far = 4;
Point(1) = {0, 0, 0, near};
Point(2) = {2, 0, 0, near};
Point(3) = {20, 0, 0, far};
Point(4) = {20, -20, 0, far};
Point(5) = {0, -20, 0, far};
Point(6) = {0, -2, 0, near};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};
Physical Surface("block") = {1};
Physical Curve("top") = {1, 2};
Physical Curve("base") = {4};
Physical Curve("axis") = {5, 6};
