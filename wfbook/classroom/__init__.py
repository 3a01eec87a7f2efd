"""The book in a classroom: copies for students and teachers, and marks for what students hand in."""
