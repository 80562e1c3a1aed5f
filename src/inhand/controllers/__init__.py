"""Controllers: joint poses, inverse kinematics, and the search for contact points they start from."""
